(expect: arc-center 2:1)
G2 X10 Y10 F100
M30
