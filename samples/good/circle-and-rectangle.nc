%
O0511 (2.5-axis part after experiment III of the thesis: a round and a rectangular section, 1 mm apart in height)
(Shows: Z moves alone, X and Y together; rings and rows made by loops; tool of 6 mm, 1 mm of width a pass)
G17 G21 G40 G90 G94
M3 S2000
G0 Z5
(round section, 20 mm wide, 0.5 mm deep: rings from the middle out)
G0 X-30 Y0
G1 Z-0.5 F60
#1=1
WHILE [#1 LE 7] DO1
G1 X[-30+#1] F300
G3 I[-#1] J0 F400
#1=#1+1
END1
G0 Z5
(rectangular section, 22 x 18 mm, 1.5 mm deep in three layers: rows in X)
#2=0
WHILE [#2 LT 3] DO1
#2=#2+1
G0 X15 Y-6
G1 Z[-0.5*#2] F60
#3=-6
WHILE [#3 LT 6] DO2
G1 X31 F400
Y[#3+1]
X15
#3=#3+2
Y#3
END2
G1 X31
G0 Z5
END1
(its outline once round)
G0 X15 Y-6
G1 Z-1.5 F60
X31 F240
Y6
X15
Y-6
G0 Z5
M5
G0 X0 Y0
M30
%
