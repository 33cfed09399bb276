(expect: compensation-gouge 6:1)
G10 L1 P1 R3
G41 D1 G1 X0 Y10 F300
X10
Y12
X20
G40 Y30
M30
