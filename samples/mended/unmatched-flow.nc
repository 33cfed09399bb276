#1=0
o100 while [#1 LT 5]
#1=[#1+1]
o101 if [#1 EQ 3]
G0 X1
o101 endif
o100 endwhile
M30
