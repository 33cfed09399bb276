(expect: feed-units 2:5)
G20 F10
G1 X1
M30
