(machine: ideal; dialect: linuxcnc)
(A contour is roughed out, then finished with the nose of the tool compensated.)
G21 G18 G90 G7
F80
O100 sub
  G0 X0 Z2
  X20 A2
  Z-15
  G2 X30 Z-20 R5
  G1 X40 C1
  Z-40
O100 endsub
G0 X44 Z2
G71 Q100 D0.5 I2 R0.5
G42.1 D0.8 L2
G70 Q100 X44 Z2
G40 G0 X60
M30
