(expect: unknown-label 3:1)
N10 G0 X1
GOTO 20
M30
