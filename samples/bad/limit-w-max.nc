(expect: limit-w-max 4:1 on nine-axes)
G0 W40
W60
W70.5
W60
W0
M30
