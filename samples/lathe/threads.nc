(machine: ideal; dialect: linuxcnc)
(Threads on a lathe: G33 in step with the spindle, a rigid tap, the cycle G76; a probe.)
G21 G18 G90 G8
S400 M3
G0 X12 Z3
G33 Z-20 K1.5 (1.5 mm a turn)
G33 X13 Z-21 K1.5 (out of the work, still in step)
G0 X12 Z3
G76 P1.5 Z-20 I-2 J0.4 K0.92 R2 Q29.5 H1 E1.5 L2
G0 X0 Z5
G33.1 Z-8 K0.8
G0 X30
G38.2 X20 F100 (on this machine it touches at X20)
G0 X[#5061+5]
M66 P1 L3 Q5
M5
M30
