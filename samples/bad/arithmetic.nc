(expect: arithmetic 3:4)
#1=0
G0 X[1/#1]
M30
