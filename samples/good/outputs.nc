(Outputs, a tool that is in the spindle already, the spindle's orientation: events.)
G21 G90
M61 Q3
M64 P2
M62 P1
G1 X2 F300
M63 P1 M5
M68 E0 Q-1.5
M67 E1 Q2.25
S500 $0 M3
M19 R90 P1 Q5
M199 P7
M65 P2
M30
