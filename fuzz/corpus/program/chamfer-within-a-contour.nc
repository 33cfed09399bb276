(Chamfers, fillets and angles of a FANUC-style lathe, with commas and without)
O0002 (machine: samples/machines/lathe.toml; dialect: fanuc-lathe)
G97 S800 M3
T0100
G0 X62 Z2
G71 P10 Q20 U0.4 W0.1 F0.3
N10G80  G0 X16
G1 Z0 F0.1
X20 C2
Z-20G55  R3
G1 X50 ,C2
X30 K-1
Z-30 I1
X40 A150
N20 Z-60
G5
G70 P10 Q20
G0 X68 Z-70
G1 X50 ,C2
Z-90
A150 R2
X90 Z-140 A180
