(expect: limit-z-min 3:4 on nine-axes)
G91
G0 Z-50.02
M30
