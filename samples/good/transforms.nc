(Scaling, mirroring, rotation, polar coordinates; centres of arcs as positions.)
G21 G90 G17 F300
G0 X0 Y0
G51 X0 Y0 P2
G1 X5 Y5
G2 X10 Y0 I0 J-5
G51 X0 Y0 I-1 J1 K1 (mirrored in X: the arc turns the other way)
G1 X10 Y0
G2 X0 Y10 I-10 J0
G50
G68 X0 Y0 R30
G1 X20 Y0
G3 X10 Y10 R10
G91 G1 X5
G90 G69
G16 G1 X20 Y30 (20 mm from zero, at 30 degrees)
Y90
X30
G99 G81 X25 Y120 Z-2 R1
Y150
G80 G15
G90.1 G0 X0 Y0
G3 X10 Y10 I0 J10 F300
G91.1 G1 X0 Y0
M30
