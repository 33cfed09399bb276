(expect: nurbs-unopened 3:1)
G0 X1
G5.3
M30
