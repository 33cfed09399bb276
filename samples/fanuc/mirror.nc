O1 (Mirror images, with scaling, rotation, arcs and compensation within them)
(machine: ideal; dialect: fanuc)
G21 G90 G17 G40 G80
G10 L12 P1 R2.
G0 X10. Y0
M98 P2
G51.1 X0
M98 P2
G51.1 Y-5.
M98 P2
G50.1 X0
M98 P2
G50.1 Y0
G51.1 X50.
G68 X0 Y0 R30.
G1 X20. Y0
G69
G51 X0 Y0 P2.
G2 X20. Y10. R10.
G50
G91 G51.1 Y1.
G90 G1 Y3.
G50.1
G0 X0 Y0
M30
O2
G0 X10. Y0
G1 X20. F200
G2 X30. Y10. I0 J10.
G41 D1 G1 X20. Y10.
Y30.
X40.
G40 Y40.
M99
