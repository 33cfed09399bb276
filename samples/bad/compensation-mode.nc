(expect: compensation-mode 4:1)
G41.1 D4 G1 X0 Y10 F300
X10
G53 G0 X80
G40 Y30
M30
