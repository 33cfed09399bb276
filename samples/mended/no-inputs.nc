(set Z by hand, then cut)
M0
G1 Z-2 F50
M30
