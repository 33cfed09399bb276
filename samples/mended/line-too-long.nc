(a line as long as it has to be)
M30
