G0 X1 (to the right)
M30
