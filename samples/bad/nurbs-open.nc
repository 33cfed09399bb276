(expect: nurbs-open 4:1)
G5.2 P1 L3 F100
X0 Y1 P1
G1 X2 Y2
G5.3
M30
