(expect: bad-value 2:4)
G1 F-100 X1
M30
