(expect: no-feed 2:1)
G1 X1
X2
X3
M30
