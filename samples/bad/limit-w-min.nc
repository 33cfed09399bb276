(expect: limit-w-min 3:4 on nine-axes)
G91
G0 W-50.02
M30
