(O words: loops, branches, and what leaves them.)
G21 G90 G1 F600
#1=0
o100 while [#1 LT 3]
  #1=[#1+1]
  o110 if [#1 EQ 2]
    o100 continue
  o110 elseif [#1 EQ 3]
    X30
  o610 else
  
  o110 endif
  Y#1
o100 endwhile
o200 do
G94   #1=[--------------------------------#1-1]
  X#1
o200 while [#1 GT 1]
o300 repeat [5]
  o310 repeat [2]
    Z#1
    #1=[#1+1]
G99   o310 endrepeat
  o320 if [#
    o300 break
  o320 endif
o300 endrepeat
o100 while [#1 LT 3]
M2
