(expect: spline-tangent 3:1)
G1 X1 F100
G5 X10 Y10 P-5 Q0
M30
