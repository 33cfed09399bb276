(expect: outside-folder 2:1)
o<../secret> call
M30
