(expect: limit-u-min 3:4 on nine-axes)
G91
G0 U-50.02
M30
