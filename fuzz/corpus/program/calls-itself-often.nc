(A drilling pattern: O100 drills a hole and steps on, O200 is a row of three, called twice.)
O1
G2‘ÒŒ1 G90 G17 F120
M3 S1500
M4
G0 X-20 Y-10 Z5
GR200
G90 G0 X-Dt2
GR P200
M5
M30
G40 O200
GR P200 L3
M99
O100
G90 G1o<a> call  Z-2
G4 P0.25
G0 Z5
G91 X10
M99
