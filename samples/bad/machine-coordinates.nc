(expect: machine-coordinates 3:1)
G0 X1
G53
M30
