% 
O0009 (Incremental, a * at the end of each block, arcs from the start point, as in the 1990s.)
G21 G91 G17 *
N001 G00 X2.0 Y0.0 F1000 *
N002 G03 X8.0 Y-8.0 I8.0 J0.0 F200 *
N003 G01 Y3.0 F1000 *
N004 G03 X-4.0 Y4.0 I-4.0 J0.0 F200 *
N005 G01 X-6.0 Y1.0 F1000 *
M30 *
%
