(expect: arc-radius 4:1)
(the end lies 30 mm beside the circle: X-3.66 was meant)
G91 G1 F200 X-10
G3 X-33.66 Y-3.66 I5 J-8.66
M30
