(expect: limit-c-min 3:4 on nine-axes)
G91
G0 C-50.02
M30
