(Roughing of contours that go in again, along Z and along X)
O0003 (machine: samples/machines/lathe.toml; dialect: fanuc-lathe)
G97 S800 M3
T0100
G0 X62 Z2
G71 U2 R0.5
G71 P10 Q20 U0.4 W0.1 F0.2
N10 G0 X40 Z2
G1 Z-10
X30 Z-15
G2 X30 Z-25 R8
G1 X40 Z-30 ,R2
Z-40
N20 X62
G70 P10 Q20
G0 X62 Z2
G72 W1 R0.5
G72 P30 Q40 U0 W0 F0.2
N30 G0 X62 Z-10
G1 X50
X46 Z-6
X40
X36 Z-10
X20
N40 Z2
M30
