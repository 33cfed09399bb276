(expect: bad-parameter 2:1)
#0=1
M30
