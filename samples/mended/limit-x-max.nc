(the ends lie within the travel, the bulge of the arc does not)
G0 X50 Y-20
G3 X50 Y20 I0 J20 F200
M30
