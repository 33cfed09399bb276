(expect: limit-z-max 4:1 on nine-axes)
G0 Z40
Z60
Z70.5
Z60
Z0
M30
