(expect: axis-words-twice 2:1)
G92 G1 X5 F100
M30
