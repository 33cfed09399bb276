(expect: unused-word 2:12)
G1 X1 F100 I5
M30
