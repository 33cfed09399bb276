(expect: corner 4:8)
G0 X0 Y0
F300
G1 X20 ,R8
Y5
X0
M30
