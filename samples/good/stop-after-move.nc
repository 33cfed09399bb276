%
(Shows: functions in blocks that move: M3 and S come before the motion, M0, M1 and M30 after it)
G21 G90 G94 F600
G1 X10 Y5 M3 S1000
X20 M0
G4 P0.2
Y0 M1
X0 M30
%
