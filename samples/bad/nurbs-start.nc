(expect: nurbs-start 2:1)
G6.2 P3 K0 X0.2 Y0 F100
K0 X5 Y0
K0 X5 Y5
K1
K1
K1
M30
