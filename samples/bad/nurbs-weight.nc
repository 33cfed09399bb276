(expect: nurbs-weight 3:7)
G5.2 P1 L3 F100
X0 Y1 P0
X2 Y2 P1
G5.3
M30
