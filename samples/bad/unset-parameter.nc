(expect: unset-parameter 2:4)
G0 X#<depth>
M30
