"""Random programs of parameters, expressions and control flow. They move by small steps from
wherever they are, so that nothing has to be known of their values. The same seed gives the same
program."""

import random

# What both controls tell of themselves.
TOLD = [
    "#<_x>",
    "#5421",
    "#<_abs_z>",
    "#<_feed>",
    "#<_plane>",
    "#<_motion_mode>",
    "#<_coord_system>",
    "#<_line>",
    "#<_incremental>",
    "#5220",
]

# rs274 takes no line of more than 255 characters, so expressions are kept shallow.
DEPTH_MAX = 2


class Macro:
    """Writes a program piece by piece."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        self.lines = ["G21 G91 F100"]

    def number(self):
        return f"{self.random.uniform(-9.0, 9.0):.3f}"

    def parameter(self):
        return f"#{self.random.randint(1, 9)}"

    def expression(self, depth=0):
        """An expression whose value is always defined."""
        kind = self.random.randrange(8)
        if depth >= DEPTH_MAX or kind == 0:
            told = [self.random.choice(TOLD)] if self.random.random() < 0.3 else []
            return self.random.choice([self.number(), self.parameter(), *told])
        a, b = self.expression(depth + 1), self.expression(depth + 1)
        if kind <= 2:
            return f"[{a} {self.random.choice('+-*')} {b}]"
        if kind == 3:
            return f"[{a} {self.random.choice(['/', 'MOD'])} [ABS[{b}]+1.5]]"
        if kind == 4:
            name = self.random.choice(["ABS", "FIX", "FUP", "ROUND", "SIN", "COS"])
            return f"{name}[{a}]"
        if kind == 5:
            return f"SQRT[ABS[{a}]]"
        if kind == 6:
            return f"ATAN[{a}]/[ABS[{b}]+0.5]"
        return f"[{a} {self.random.choice(['LT', 'GT', 'LE', 'GE', 'NE'])} {b}]"

    def move(self, _):
        words = f"X[{self.expression()} MOD 7] Y[{self.expression()} MOD 7]"
        self.lines.append(f"G1 {words} Z-{self.parameter()}")

    def repeat(self, label):
        self.lines += [
            f"o{label} repeat [{self.random.randint(0, 4)}]",
            "G1 X[#1 MOD 3]",
            "#1=[#1+0.37]",
            f"o{label} endrepeat",
        ]

    def branch(self, label):
        self.lines += [
            f"o{label} if [{self.expression()} GT {self.expression()}]",
            "G1 Y1.5",
            f"o{label} elseif [{self.expression()} LT 1]",
            "G1 Y2.25",
            f"o{label} else",
            "G0 Y-1",
            f"o{label} endif",
        ]

    def loop(self, label):
        self.lines += [
            "#9=0",
            f"o{label} while [#9 LT {self.random.randint(0, 5)}]",
            "#9=[#9+1]",
            f"o{label + 1} if [#9 EQ 3]",
            f"o{label} {self.random.choice(['break', 'continue'])}",
            f"o{label + 1} endif",
            "G1 Z[#9/2]",
            f"o{label} endwhile",
        ]

    def call(self, label):
        self.lines += [
            f"o<sub{label}> sub",
            self.random.choice(["M73", "M73 G20 F9", "G4 P0", "M73 G18 G98"]),
            "G1 X[#1] Y[#2]",
            "#2=[#2+1]",
            f"o<sub{label}> endsub [#1+#2]",
            f"o<sub{label}> call [{self.expression()} MOD 5] [{self.number()}]",
            "G1 Z[#<_value> MOD 4]",
        ]

    def numbered_call(self, label):
        self.lines += [
            f"o{label} sub",
            "G1 X[#1 MOD 2] Y0.5",
            f"o{label} endsub",
            f"#<which.one {label}>={label - 1}",
            f"o[#<WHICH.one{label}>+1] call [{self.expression()}]",
        ]


def generate(seed):
    """A program of some dozens of lines."""
    macro = Macro(seed)
    pieces = [macro.move, macro.move, macro.repeat, macro.branch, macro.loop, macro.call]
    pieces.append(macro.numbered_call)
    for piece in range(macro.random.randint(3, 12)):
        macro.lines.append(f"{macro.parameter()}=[{macro.expression()} MOD 7]")
        macro.random.choice(pieces)(100 + 2 * piece)
    macro.lines.append("M2")
    return "\n".join(macro.lines) + "\n"
