(Corners by ,R and ,C, lines by their angle)
G21
G56
G68 X0 Y0 R30
G1 Z0 F200
X30 ,R6
Y20 ,C4
X0 ,R3
Y0
X20 ,A30
G2 X30 Y30 R12 ,R2
G1 X5
G57 X0 Y0
G1 ,A60 ,R3
X40 Y10 ,A-45
G91 X-10 ,A180 ,C1
Y-1
G90 Y0
G2 X10 Y-20 I-20 J0 ,C3 (a chamfer between an arc and a line, its ends 3 from the corner)
G1 Y-25
X-10 ,R4
,A90 ,C2 (a line whose end the next block tells, behind a corner)
X-20 Y30 ,A150
M30
