(expect: limit-x-min 3:4 on nine-axes)
G91
G0 X-50.02
M30
