(expect: missing-return 4:1)
GR10
M30
O10
G0 X1
