(expect: limit-x-max 4:4)
(the ends lie within the travel, the bulge of the arc does not)
G0 X60 Y-20
G3 X60 Y20 I0 J20 F200
M30
