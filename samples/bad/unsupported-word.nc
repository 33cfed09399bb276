(expect: unsupported-word 3:5)
G0 Z2
G10 L13 P1 X0
M30
