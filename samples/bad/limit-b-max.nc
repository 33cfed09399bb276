(expect: limit-b-max 4:1 on nine-axes)
G0 B40
B60
B70.5
B60
B0
M30
