#<depth>=2
G0 X#<depth>
M30
