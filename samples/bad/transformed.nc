(expect: transformed 3:1)
G68 X0 Y0 R45
G92 X0
G69
M30
