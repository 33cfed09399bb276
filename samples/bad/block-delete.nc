(expect: block-delete 2:1)
/G0 X1
M30
