(expect: missing-end 2:1)
G0 X1
