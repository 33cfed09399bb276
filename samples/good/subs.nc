(Subprograms of RS274/NGC: arguments, locals, values that come back, recursion.)
o<row> sub (count, pitch)
  #<left>=#1
  o10 while [#<left> GT 0]
    G91 G0 X#2
    #<left>=[#<left>-1]
  o10 endwhile
o<row> endsub [#1*#2]
o<factorial> sub
  o20 if [#1 LE 1]
    o<factorial> return [1]
  o20 endif
  o<factorial> call [#1-1]
o<factorial> endsub [#<_value>*#1]
G21 G90
#1=5
o<row> call [3] [2.5]
G90 G0 Y#<_value> (7.5)
Z#1 (5: the sub had a #1 of its own)
o<factorial> call [4]
X#<_value> (24)
M30
