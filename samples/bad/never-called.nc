(expect: never-called 6:6)
GR P100
M30
O100 G0 X1
M99
O200 M999
M99
