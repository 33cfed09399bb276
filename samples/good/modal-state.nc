(Modes are saved, restored and, in a subprogram, restored at its end.)
G21 G90 G0 X1 Y1 F300 S800
M70
G91 G20 F5 S100
G1 X0.1 (a tenth of an inch further)
M72
G1 X5 Y2 (in mm, at 300 mm/min)
o<step> call [2]
X8 (absolute again)
o<step> call [1]
X9
M100 P1 Q2.5
M30
o<step> sub
M73
G91 G8 M3
G1 Z#1 F60
o<step> endsub
