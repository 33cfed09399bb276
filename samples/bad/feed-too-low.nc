(expect: feed-too-low 3:4)
G0 X0
G1 F0.00001 X1 (ten weeks)
F0.1 X0
M30
