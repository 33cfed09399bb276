(expect: bad-number 2:4)
G0 X1.2.3
M30
