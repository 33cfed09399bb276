(Work coordinate systems, G92, G52, G53, references, and lengths of tools set by the program.)
G21 G90 G17
G10 L2 P2 X30 Y20 Z50
G0 X0 Y0 Z0
G55 X0 Y0 (machine X30 Y20)
G92 X10 Y10 (the same place is X10 Y10 now)
G1 X20 F300
G92.2
X0
G92.3
X0 (machine X20)
G92.1
G52 X5 Y5
X0 Y0
G52 X0 Y0
G10 L20 P0 X1 Y1 (G55, so that this is X1 Y1)
X0 Y0
G10 L2 P3 X75 Y50 Z50 R90 (turned: X goes along Y)
G56 X0 Y0
X10
G2 X20 Y0 R5
G54 G10 L1 P4 Z12.5 R3
G43 H4 G0 Z5
G43.1 Z2
G1 Z5
G49 Z5
G28.1
G30.1
G53 G0 X70
G91 G28 X0 Z1 (by way of a place 1 mm higher)
G30 Y5
G90 G53 G0 X75 Y50 Z50
M30
