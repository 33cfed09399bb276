(expect: spindle-stopped 3:1)
S500 M4
G84 Z-2 R1 F100
G80
M30
