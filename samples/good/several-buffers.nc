(Cuts that outlast a node buffer of 1500 ticks: they are ramped down and up where it ends)
G21 G90 G94 G17
G0 X-30 Y-20 Z2
G1 Z-1 F60
(60 mm at 1 mm/s: a minute, four buffers)
X30 F60
(a circle at 0.5 mm/s: four minutes)
G3 X30 Y-20 I0 J20 F30
G0 Z2
X0 Y0 Z0
M30
