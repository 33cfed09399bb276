(expect: call-count 5:1)
GR1 L9999
M30
O1
GR2 L9999
M99
O2
M99
