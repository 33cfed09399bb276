(expect: arc-too-small 2:9)
G2 X20  R9.9 F200
M30
