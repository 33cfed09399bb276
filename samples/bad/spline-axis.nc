(expect: spline-axis 2:12)
G5.1 X5 Y5 Z1 I5 J0 F100
M30
