(expect: duplicate-program 6:1)
GR10
M30
O10
M99
O10
M99
