(A contour by one tool, a finishing cut by another whose feed is not overridden)
G21 G90 G17 G94
T1 M6
M3 S1500
G0 X5 Y5
G1 Z-1 F120
X45 F600
Y25
G3 X35 Y35 I-10 J0
G1 X5
Y5
G0 Z5
T2 M6
G0 X10 Y10
M49
G1 Z-1 F120
X30 F300
G4 P0.5
M48
G0 Z5
M5
M30
