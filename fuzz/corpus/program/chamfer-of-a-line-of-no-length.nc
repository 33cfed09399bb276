(Chamfers, fillets and angles of a FANUC-style lathe, with commas and without)
O0002 (machine: samples/machines/lathe.toml; dialect: fanuc-lathe)
G5
G97 S800 M3
G95 T0100
G0 X62 Z2
G71 U3 R1
G71 P10 Q20 U0.4 W0.1 F0.3
N10 G0 X16
G1 Z0 F0.1
X27 C2
Z-20 R3
X30 K-1
G54
Z-30 I1
X40 A150
N20 Z-60
G70 P10 Q20
G0 X60 Z-70
G1 X50 ,C2
Z-90
G28.1 A150 R2
X90 Z-140 A180
M30
