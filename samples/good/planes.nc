(A full circle in each plane, then a helix: each ends where it starts, the helix 3 mm higher.)
G21 G90 G17 F300
M3 S1200
G0 X10 Y0 Z0
G3 I-10 J0
G18 G2 X10 Z0 I-10
G0 X0 Y10
G19 G3 Y10 Z0 J-10
G17 G2 X0 Y10 Z3 J-10 P3
M5
M30
