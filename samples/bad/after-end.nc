(expect: after-end 4:1)
G0 X1
M30
G0 X2
G0 X3
