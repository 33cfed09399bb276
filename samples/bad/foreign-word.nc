(expect: foreign-word 2:7 leniently)
G0 X5 E1.2
X6 E1.4
M30
