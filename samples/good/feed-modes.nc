(Inverse time, feed per turn, surface speed, dwells as other controls write them; corners.)
G21 G90 G61.1
G93 G1 X10 F10 (a tenth of a minute: 100 mm/min)
Y3 X14 F60 (5 mm in a second)
G3 X14 Y13 I0 J5 F2
G95 S500 M3 G1 X0 F0.2 (0.2 mm a turn: 100 mm/min)
G94 F250 Y0
G96 D1500 S100 M3
G97 S800
G64 P0.05 Q0.01 X5
G64 Y5
G9 X0
G61 Y0
M48
M53
G4 X0.5
G4 U1
G7 X10 (a diameter: 5 mm)
G8 X0
M50 P0
M30
