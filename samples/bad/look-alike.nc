(expect: look-alike 2:4)
G0 X−5 Y3
M30
