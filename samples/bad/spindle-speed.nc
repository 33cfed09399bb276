(expect: spindle-speed 2:1)
S24000 M3
M30
