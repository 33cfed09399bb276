(expect: unsupported-word 3:1)
G0 Z2
G38.2 Z-3 F100
G80
M30
