(expect: limit-b-min 3:4 on nine-axes)
G91
G0 B-50.02
M30
