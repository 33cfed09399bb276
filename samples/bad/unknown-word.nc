(expect: unknown-word 2:1)
G5.7 X1
M30
