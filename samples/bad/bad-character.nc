(expect: bad-character 2:4)
G0 !X1
M30
