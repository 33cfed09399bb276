(expect: cycle-level 3:1)
G90 G0 Z5
G81 X5 Z-3 R-4 F100
G80
M30
