(expect: no-inputs 2:1)
G38.2 Z-2 F50
G38.2 Z-3 F20
M66 P1 L3 Q1
M30
