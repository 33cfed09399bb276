(expect: cycle-mode 2:1)
G93 G81 X5 Z-3 R1 F100
G80
M30
