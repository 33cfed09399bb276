#1=0
o100 while [#1 LT 5]
#1=[#1+1]
o100 endwhile
M30
