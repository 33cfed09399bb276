(expect: pulse-rate 4:16 on kimm)
G91 G17
G1 X20 F5000
G3 X5 Y5 I0 J5 F3000
M30
