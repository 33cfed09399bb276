%
O0521 (Truncated pyramid with a circular pocket at each of its four sides, after fig. 5.21 of the thesis)
(Shows: three axes at once on the flanks, arcs and helices, a subprogram called at four places)
G17 G21 G40 G90 G94
M3 S1500
G0 Z5
(flanks: each side of the ring lowers the tool by half a millimetre)
X15 Y15
G1 Z0 F120
F600
X-15.625 Y15.625 Z-0.5
X-16.25 Y-16.25 Z-1
X16.875 Y-16.875 Z-1.5
X17.5 Y17.5 Z-2
X-18.125 Y18.125 Z-2.5
X-18.75 Y-18.75 Z-3
X19.375 Y-19.375 Z-3.5
X20 Y20 Z-4
X-20.625 Y20.625 Z-4.5
X-21.25 Y-21.25 Z-5
X21.875 Y-21.875 Z-5.5
X22.5 Y22.5 Z-6
X-23.125 Y23.125 Z-6.5
X-23.75 Y-23.75 Z-7
X24.375 Y-24.375 Z-7.5
X25 Y25 Z-8
(one level ring at the foot)
X-25 Y25
X-25 Y-25
X25 Y-25
X25 Y25
G0 Z5
(pockets: right, far, left, near)
G0 X36 Y0
GR100
G0 X0 Y36
GR100
G0 X-36 Y0
GR100
G0 X0 Y-36
GR100
M5
G0 X0 Y0
M30
O100 (pocket of 8 mm radius, 3 mm deep below the foot, from 5 mm above the top)
G0 Z-7
G91
G1 X4 F300
(helix down, two turns)
G3 X0 Y0 Z-2 I-4 J0 F240
G3 X0 Y0 Z-2 I-4 J0
(floor, then out by half circles to full radius)
G3 X0 Y0 I-4 J0
G3 X-10 Y0 I-5 J0
G3 X12 Y0 I6 J0
G3 X-14 Y0 I-7 J0
G3 X16 Y0 I8 J0
G3 X0 Y0 I-8 J0
G1 X-8 F300
G90
G0 Z5
M99
%
