(expect: alarm 3:19)
#1=1
IF [#1 EQ 1] THEN #3000=7 (TOOL TOO LONG)
M30
