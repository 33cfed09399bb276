(expect: open-comment 2:7)
G0 X1 (to the right
M30
