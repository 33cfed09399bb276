%
O0544 (Slots with the cutting parameters of the thesis, tables 5.3 and 5.4: a mill of 6 mm with two teeth, 1 mm deep)
(Shows: cnc cut, which holds feeds against the power of the spindle)
G17 G21 G90 G94
G0 X-30 Y-20 Z5
M3 S2000
G1 Z-1 F60
(a mean chip of 0.1 mm, as in table 5.4)
X30 F628.319
Y-10
F900
X-30 Y10
(0.59 mm a tooth, as in table 5.4: 2360 mm/min, which the axes do not reach)
X30 F2360
G0 Z5
M5
M30
%
