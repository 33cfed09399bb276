(expect: rapid-into-work 5:1)
M3 S1500
G0 X10 Y10 Z5
X20
Z-3
G1 X30 F100
M30
