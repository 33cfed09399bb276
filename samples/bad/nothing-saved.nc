(expect: nothing-saved 5:1)
M70
G91
M71
M72
M30
