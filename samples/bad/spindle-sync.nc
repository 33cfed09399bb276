(expect: spindle-sync 3:1)
S500 M3
G33 Z-2 K1
Z-3 K1
M30
