(expect: contour-word 5:7)
G18 F100
O100 sub
G0 X0 Z5
G1 X5 Y2 Z-5
O100 endsub
G70 Q100 X10 Z10
M30
