O001 (Experiment I of the thesis, table 5.2: rapids that return to the step; no program end)
N010 G21 G40 G91
N020 G0 X70 Y20
N030 X-70 Y-20
N040 M5
