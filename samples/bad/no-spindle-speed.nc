(expect: no-spindle-speed 2:1)
G95 G1 X5 F0.1
Y5
M30
