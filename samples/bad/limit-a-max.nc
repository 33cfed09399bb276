(expect: limit-a-max 4:1 on nine-axes)
G0 A40
A60
A70.5
A60
A0
M30
