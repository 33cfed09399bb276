(expect: system-unset 2:1)
G55 G0 X1
G54 X0
G55 X0
M30
