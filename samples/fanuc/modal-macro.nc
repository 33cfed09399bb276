O1 (G66: a macro after every move; M97: blocks of the same program)
(machine: ideal; dialect: fanuc)
G21 G90 G17
G0 X0 Y0 Z10.
G66 P2 L2 A1. Z-3. F100
X10.
F50 (no move: no call)
Y10.
M98 P3 (its moves call nothing)
G67
X20.
M97 P100 L2
#1=0
WHILE [#1 LT 2] DO1
M97 P100
#1=#1+1
END1
G0 Z10.
M30
N100 G91 G1 X1. F200
G90
M99
O2
G0 Z#1
G1 Z#26 F#9
G0 Z10.
M99
O3
X15.
M99
