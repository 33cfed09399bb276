(expect: limit-v-max 4:1 on nine-axes)
G0 V40
V60
V70.5
V60
V0
M30
