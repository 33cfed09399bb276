(expect: limit-y-max 4:1 on nine-axes)
G0 Y40
Y60
Y70.5
Y60
Y0
M30
