(expect: limit-a-min 3:4 on nine-axes)
G91
G0 A-50.02
M30
