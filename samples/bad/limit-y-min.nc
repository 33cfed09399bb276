(expect: limit-y-min 3:4 on nine-axes)
G91
G0 Y-50.02
M30
