(expect: limit-c-max 4:1 on nine-axes)
G0 C40
C60
C70.5
C60
C0
M30
