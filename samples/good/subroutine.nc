(A drilling pattern: O100 drills a hole and steps on, O200 is a row of three, called twice.)
O1
G21 G90 G17 F120
M3 S1500
G0 X-20 Y-10 Z5
GR200
G90 G0 X-20 Y10
GR P200
M5
M30
O200
GR P100 L3
M99
O100
G90 G1 Z-2
G4 P0.25
G0 Z5
G91 X10
M99
