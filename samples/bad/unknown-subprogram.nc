(expect: unknown-subprogram 2:1)
GR10
M30
O11
M99
