(Corners: kept, cut within 0.05 and 0.2 mm, rounded beside arcs; a way back is never cut short.)
G21 G90 G17
G0 Z2
G1 X0 Y0 Z0 F1000
G61 (the path is kept)
X20
Y10
G64 P0.05 (corners may be cut by 0.05 mm)
X0
Y20
X20
G64 P0.2
Y30
G2 X30 Y20 R10 (a right angle into an arc, and another out of it)
X40 Y30 I10 J0
G1 X40 Y0
G64 (as far as the machine's own path tolerance)
X30
Y5
G64 P0.2
Z2
Z0 (back the same way)
X0 Y0 Z2
M30
