(expect: reference-unset 2:1)
G91 G28 Z0
M30
