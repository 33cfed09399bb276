(expect: expression 2:4)
G0 X[1 + ]
M30
