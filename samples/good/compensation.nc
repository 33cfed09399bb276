(Cutter compensation: lead-in, inside and outside corners of lines and arcs, functions between, lead-out.)
G21 G90 G17
G10 L1 P2 R2
G0 X0 Y-10 Z1
T2 M6
G41 G1 X5 Y0 F300 (leads in)
G1 Y20
X15
Y12 (outside, then inside)
M8
Z-1
X25
G2 X33 Y4 I0 J-8 (tangent)
G1 Y0
G2 X25 Y0 I-4 J0
G3 X15 Y0 R5
G1 X-5
G40 G1 Y-10 (leads out)
G42 D2 X5 Y-5
X30
G3 X30 Y5 I0 J5
G1 X5
Y-10
G40
Z5
G0 X0 Y-10
G18 G42.1 D4 G1 Z8 X5
X20
Z12
X5
G40 Z20 X0
G17 G0 Y-10 Z5
G41.1 D4 G1 X5 Y0
X10
G2 X20 R5
G1 Y10 (straight back: the arc lies on the tool's side, so this is an inside corner)
X30
G40 Y20
M30
