(a floating tap holder follows the thread)
S500 M3
G84 X0 Y0 Z-2 R1 F500
G80
M30
