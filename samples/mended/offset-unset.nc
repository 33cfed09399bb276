(offset 0: the tool as it is)
T0100
G0 X5 Z2
M30
