"""Random valid NC programs: lines, arcs and helices in all planes, units, distance modes, feeds,
dwells. The same seed gives the same program."""

import math
import random

PLANES = {"G17": "XYZ", "G18": "ZXY", "G19": "YZX"}
CENTERS = {"X": "I", "Y": "J", "Z": "K"}


class Writer:
    """Writes a program and follows the position, in program units, so that arcs are true."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        self.lines = []
        self.at = dict.fromkeys("XYZ", 0.0)
        self.absolute = True
        self.plane = "G17"

    def number(self, size):
        return round(self.random.uniform(-size, size), 3)

    def word(self, axis, target):
        value = target if self.absolute else target - self.at[axis]
        return f"{axis}{value:.4f}"

    def go(self, code, targets, more=""):
        words = "".join(self.word(axis, target) for axis, target in targets.items())
        self.lines.append(f"{code} {words} {more}".rstrip())
        self.at.update(targets)

    def straight(self):
        axes = self.random.sample("XYZ", self.random.randint(1, 3))
        targets = {axis: round(self.at[axis] + self.number(5.0), 3) for axis in axes}
        self.go(self.random.choice(["G0", "G1", "G1"]), targets)

    def arc(self):
        first, second, across = PLANES[self.plane]
        radius = round(self.random.uniform(0.5, 4.0), 3)
        start = self.random.uniform(0.0, math.tau)
        sweep = self.random.uniform(0.3, math.tau - 0.3)
        center = [
            self.at[first] - radius * math.cos(start),
            self.at[second] - radius * math.sin(start),
        ]
        ccw = self.random.random() < 0.5
        angle = start + (sweep if ccw else -sweep)
        kind = self.random.choice(["center", "center", "full", "radius"])
        code = "G3" if ccw else "G2"
        targets = {
            first: round(center[0] + radius * math.cos(angle), 4),
            second: round(center[1] + radius * math.sin(angle), 4),
        }
        if self.random.random() < 0.4:
            targets[across] = round(self.at[across] + self.number(2.0), 3)
        offsets = (
            f"{CENTERS[first]}{center[0] - self.at[first]:.4f} "
            f"{CENTERS[second]}{center[1] - self.at[second]:.4f}"
        )
        if kind == "full":
            targets[first], targets[second] = self.at[first], self.at[second]
            turns = self.random.choice(["", "", " P2", " P3"])
            self.go(code, targets, offsets + turns)
        elif kind == "radius" and abs(sweep - math.pi) > 0.2:
            sign = "-" if sweep > math.pi else ""
            self.go(code, targets, f"R{sign}{radius:.4f}")
        else:
            self.go(code, targets, offsets)

    def modes(self):
        choice = self.random.randrange(4)
        if choice == 0:
            self.absolute = self.random.random() < 0.5
            self.lines.append("G90" if self.absolute else "G91")
        elif choice == 1:
            self.plane = self.random.choice(list(PLANES))
            self.lines.append(self.plane)
        elif choice == 2:
            self.lines.append(f"F{self.random.randint(10, 900)}")
        else:
            self.lines.append(f"G4 P{self.random.randint(0, 40) / 10}")


def generate(seed):
    """A program of some dozens of lines."""
    writer = Writer(seed)
    unit = writer.random.choice(["G20", "G21"])
    writer.lines += [f"{unit} G17 G90 G94", f"F{writer.random.randint(50, 500)}"]
    for _ in range(writer.random.randint(5, 60)):
        step = writer.random.choice([writer.straight, writer.arc, writer.arc, writer.modes])
        step()
    writer.lines.append(writer.random.choice(["M2", "M30"]))
    return "\n".join(writer.lines) + "\n"
