(expect: missing-word 2:1)
G4
M30
