(expect: repeated-word 2:7)
G0 X1 X2
M30
