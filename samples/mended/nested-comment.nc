G0 X1 (side 1, rough, of 2)
M30
