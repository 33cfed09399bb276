(Spindle, coolant, tools, dwells and stops, and the order in which one block does them.)
G21 G90 G94 G97 G40 G49 G54 G61 G80
T3
M6
T4 M6 S900 M3 M8
S1100
G0 X5 F200 M7
G1 X10 M9
G4 P1.5 M4 S800
M0
M1
M60
G53 G0 X75 Y50 Z50
M5
M30
