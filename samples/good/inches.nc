(Inches: positions, arc centres and feeds come out in mm; rapids and units may change at will.)
G20 G90
G1 F10 X1 Y0.5
G2 X1.5 Y0 I0 J-0.5
G21
G1 X25.4 Y12.7
G91 G20 X.1 Y-.1
M30
