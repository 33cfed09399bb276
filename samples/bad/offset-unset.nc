(expect: offset-unset 2:1 on ideal; dialect: fanuc-lathe)
T0101
G0 X5 Z2
T0100
M30
