(expect: arc-closed 3:4)
G0 X10
G2 R10 F200
M30
