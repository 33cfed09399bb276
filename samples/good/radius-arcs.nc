(Arcs by radius: the short way for R > 0, the long way for R < 0, half a circle in between.)
G21 G90 G17
G0 X10 Y0
G3 X0 Y10 R10 F400
G3 X10 Y0 R-10
G2 X-10 Y0 R10
G3 X10 Y0 R10
G18 G2 X0 Z-10 R10
G19 G3 Y10 Z0 R10
M2
