(expect: missing-number 2:4)
G0 X Y1
M30
