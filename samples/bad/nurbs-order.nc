(expect: nurbs-order 2:9)
G5.2 P1 L12 F100
X0 Y1 P1
X2 Y2 P1
G5.3
M30
