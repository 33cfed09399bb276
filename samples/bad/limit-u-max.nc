(expect: limit-u-max 4:1 on nine-axes)
G0 U40
U60
U70.5
U60
U0
M30
