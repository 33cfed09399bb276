(expect: call-alone 2:6)
GR10 X1
M30
O10
M99
