(expect: arc-radius-doubtful 2:1)
G2 X10 Y10.02 I10 J0 F200
M30
