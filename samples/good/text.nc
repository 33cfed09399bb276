(Text as it comes: byte order mark, CR LF and CR, lower case, blanks inside words, none between.)
g21g90g17f250
n10 g 1 x 1 0 . 5 y-	2n20x11y+3.;to the end of the linen30 (in between) z0. 2 5
/n40 x0y0z0

%
