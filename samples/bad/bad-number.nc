(expect: bad-number 2:8)
G0 X1.2.3
M30
