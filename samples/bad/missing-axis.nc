(expect: missing-axis 2:7)
G0 X1 A90
M30
