(expect: limit-v-min 3:4 on nine-axes)
G91
G0 V-50.02
M30
