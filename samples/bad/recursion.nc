(expect: recursion 9:1)
O1
GR10
M30
O10
GR20
M99
O20
GR10
M99
