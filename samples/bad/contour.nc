(expect: contour 8:1)
G18 F100
O100 sub
G0 X0 Z5
G1 X5 Z-5
X1 Z2 (back again)
O100 endsub
G71 Q100 X10 Z10 I1
M30
