(The thesis's own experiment: out and back by two incremental rapids, ends where it starts.)
O001
N010 G21 G40 G91
N020 G0 X70 Y20
N030 X-70 Y-20
N040 M5
N050 M30
