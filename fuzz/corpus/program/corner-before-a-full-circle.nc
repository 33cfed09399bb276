(Corners by ,R and ,C, lines by their angle)
G21 G90 G17
G0 X0 Y0 Z5
G1 Z0 F200
X30 ,R6
(Corners by ,R and ,C, lines by their angle)
Y20 ,C4
X0 ,R3
Y0
X20 ,A30
G2 X30 Y30 R12 ,R2
J-1
G1 X5
G1 ,A60 ,R3
X40 Y10 ,A-45
G91 X-10 ,A180 ,C1
Y-10
M30
