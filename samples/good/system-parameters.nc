(What a program can ask the control and tell it; offsets are in mm here, in inches at an inch machine.)
G21 G90 G54 *
G0 X#5221 (G54 lies at machine X75)
#5241 = 80 #5242 = 40
G55 G0 X1 Y1 (G55 lies where its parameters say)
#5241 = 90
G0 X2 (until it is chosen anew, it stays)
G54
G55 G0 X1
G92 X11
#5211 = -5
G0 X12
G92.3 G0 X1 (what #5211 says)
G92.1 G54
#5161 = 70 #5162 = 45 #5163 = 60
G28
o10 if [#<_coord_system> EQ 540 AND #<_plane> EQ 170]
  G1 X#<_selected_tool> F[#<_feed> + 250]
o10 endif
#<_my[1].name> = 3
G1 Y#<_MY[1] . name> Z[#<_abs_x> - #5021 - 70]
O#<_my[1].name> call [EXISTS[#<_hal[motion.probe]>]]
G10 L10 P2 Z5 R3
T2 M6 G43
G1 Z4 (#5403 and #5410 are those of tool 2) X[#5403 / 10 + #5410]
M30
o3 sub
G1 X[1 + #1] F200
o3 endsub
