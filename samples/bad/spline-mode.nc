(expect: spline-mode 3:1)
G18 F100
G5 X10 Y10 I0 J5 P-5 Q0
M30
