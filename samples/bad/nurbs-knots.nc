(expect: nurbs-knots 5:1)
G6.2 P3 K0 X0 Y0 F100
K0 X5 Y0
K2 X5 Y5
K1 X0 Y5
K3
K3
K3
M30
