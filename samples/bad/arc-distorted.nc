(expect: arc-distorted 4:1)
G51 X0 Y0 I1 J2 K1
G1 F100 X0 Y0
G2 X10 Y0 I5
G50
M30
