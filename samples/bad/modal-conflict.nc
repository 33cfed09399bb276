(expect: modal-conflict 2:4)
G0 G1 X1 F100
M30
