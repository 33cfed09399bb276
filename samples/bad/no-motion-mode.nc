(expect: no-motion-mode 2:5)
G90 X1 Y1
M30
