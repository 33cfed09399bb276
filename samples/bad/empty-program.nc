(expect: empty-program 2:1)
(nothing but remarks)
