(expect: unsupported-word 3:1)
G0 Z2
G81 X1 Y1 Z-3 R1 F100
X2 Y2
G80
M30
