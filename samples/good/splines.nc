(Splines of one block: G5 cubic, the second going on smoothly from the first; G5.1 quadratic.)
G21 G90 G17
G0 X0 Y0
F600
G5 X10 Y10 I0 J6 P-6 Q0
X20 Y0 P0 Q4 (no I and J: on in the direction of the end before)
G5 X0 Y0 I-5 J-5 P5 Q-5
(a cusp at the top)
G5 X10 Y0 I10 J8 P-10 Q8
G5.1 X0 Y0 I-5 J12
G91 G5.1 X4 Y4 I4 J0
G20 G90
G5.1 X0 Y0 I-.1 J-.1 F20
G21 G93 G5 X8 Y-8 I4 J0 P0 Q4 F20
G94 G51 X0 Y0 I1.5 J.75 K1
G68 X0 Y0 R30
G1 X10 Y0 F500
G5 X0 Y10 I0 J5.523 P5.523 Q0
G69 G50
M2
