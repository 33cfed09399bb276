(expect: nurbs-points 4:1)
G5.2 P1 L4 F100
X0 Y1 P1
G5.3
M30
