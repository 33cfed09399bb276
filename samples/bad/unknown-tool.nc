(expect: unknown-tool 3:8)
G10 L1 P1 Z5
G0 G43 H2 Z5
Z500
M30
