%
O1 (Further work coordinate systems and the shift of all, as G10 and as parameters)
(machine: ideal; dialect: fanuc)
G21 G90 G17 G40 G80
G10 L2 P1 X0 Y0 Z0
G10 L20 P1 X100. Y50. Z-20. (machine coordinates)
G10 L20 P300 X-30.
G54.1 P1 G0 X1. Y1. Z5. (machine X101 Y51 Z-15)
G54 P300 X1. (the same code: machine X-29)
G91 G10 L20 P1 X2.
G90 G54.1 P1 X0 (machine X102)
#7002=60.
#19981=#7001+1.
Y0 (machine Y60)
G54.1 P300 X0 (machine X103)
G154 P1 X0 (as Haas writes it)
G10 L2 P0 Z1. (all of them are shifted)
Z0 (machine Z-19)
G54 X0 Y0 Z0 (machine Z1)
#5203=0
#1=#4014
G54 M98 P2 (P is that of M98)
M30
O2
G0 Z0
M99
%
