(expect: decimal-comma 2:4)
G0 X1,5 Y3
M30
