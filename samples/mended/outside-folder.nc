o<secret> sub
G0 X1
o<secret> endsub
o<secret> call
M30
