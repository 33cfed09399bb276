"""Random valid NC programs: lines, arcs and helices in all planes, units, distance modes, feeds,
dwells, coordinate systems and offsets, drilling cycles, compensated outlines, splines, threads,
probes and turned contours. The same seed gives the same program."""

import math
import random

PLANES = {"G17": "XYZ", "G18": "ZXY", "G19": "YZX"}
CENTERS = {"X": "I", "Y": "J", "Z": "K"}


def turns(points):
    """By how much the way through some points turns at each, in radians."""
    ways = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in zip(points, points[1:])]
    return [abs(math.remainder(b - a, math.tau)) for a, b in zip(ways, ways[1:])]


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

    def place(self):
        """Somewhere known, whatever the coordinates mean now."""
        self.absolute = True
        self.lines.append("G90")
        self.go("G0", {axis: self.number(5.0) for axis in "XYZ"})

    def offset(self):
        point = " ".join(f"{axis}{self.number(9.0):.3f}" for axis in "XYZ")
        system = self.random.randint(1, 9)
        name = f"G{53 + system}" if system <= 6 else f"G59.{system - 6}"
        self.lines += self.random.choice(
            [
                [f"G10 L2 P{system} {point}", name],
                [f"G10 L20 P{system} {point}", name],
                [name],
                [f"G92 {point}"],
                ["G92.1"],
                ["G92.2"],
                ["G92.3"],
                [f"G52 {point}"],
                ["G52 X0 Y0 Z0"],
                [f"G43.1 Z{self.number(9.0):.3f}"],
                ["G49"],
                ["G90", f"G53 G0 {point}"],
            ]
        )
        self.place()

    def inverse_time(self):
        """Some lines with their time instead of their feed."""
        self.lines.append("G93")
        for _ in range(self.random.randint(1, 4)):
            target = {"X": round(self.at["X"] + 1.0 + self.random.random(), 3)}
            self.go("G1", target, f"F{self.random.randint(1, 90) / 10}")
        self.lines.append(f"G94 F{self.random.randint(10, 900)}")

    def cycle(self):
        """Holes, drilled across the plane."""
        first, second, across = PLANES[self.plane]
        self.place()
        self.go("G0", {across: 5.0})
        # No depth is a whole number of pecks: there rs274 pecks once more, by its rounding.
        code = self.random.choice(
            ["G81", "G82 P0.5", "G83 Q0.737", "G73 Q0.737", "G85", "G89 P0.3"]
        )
        level = self.random.choice(["G98", "G99"])
        if self.random.random() < 0.5:
            depth = f"{across}{self.random.randint(-50, 0) / 10} R{self.random.randint(5, 30) / 10}"
            repeats = ""
        else:
            self.lines.append("G91")
            depth = f"{across}{self.random.randint(-50, -10) / 10} R{self.random.randint(-30, -5) / 10}"
            repeats = self.random.choice(["", " L2", " L3"])
        hole = f"{first}{self.number(5.0):.3f} {second}{self.number(5.0):.3f}"
        self.lines.append(f"{level} {code} {hole} {depth}{repeats}")
        for _ in range(self.random.randint(0, 2)):
            self.lines.append(f"{first}{self.number(5.0):.3f}")
        self.lines.append("G80")
        self.place()

    def outline(self):
        """A polygon round the origin, cut along one side with the cutter compensated."""
        self.lines += ["G90", "G17"]
        self.absolute, self.plane = True, "G17"
        corners = self.random.randint(4, 8)
        turn = self.random.choice([1, -1])
        points = []
        for corner in range(corners + 1):
            angle = turn * (corner + 0.4 * self.random.random()) * math.tau / corners
            radius = self.random.uniform(15.0, 20.0)
            points.append((round(radius * math.cos(angle), 3), round(radius * math.sin(angle), 3)))
        start = (40.0, -3.0 * turn)
        if min(turns([start, *points])) < 0.06:
            # Corners of less than 0.05 are no corners to rs274, which extends both moves there.
            return
        self.go("G0", {"X": start[0], "Y": start[1]})
        side = self.random.choice(["G41.1", "G42.1"])
        first, *rest = points
        radius = self.random.randint(1, 20) / 10
        self.lines.append(f"{side} D{radius} G1 X{first[0]:.3f} Y{first[1]:.3f}")
        self.lines += [f"G1 X{x:.3f} Y{y:.3f}" for x, y in rest]
        self.lines.append("G40")
        self.place()

    def threads(self):
        """In step with the spindle: single threads, rigid taps, and whole cycles."""
        self.lines.append(f"G97 S{self.random.randint(50, 900)} {self.random.choice(['M3', 'M4'])}")
        self.place()
        for _ in range(self.random.randint(0, 3)):
            code = self.random.choice(["G33", "G33", "G33.1"])
            before = dict(self.at)
            target = {axis: self.at[axis] + 1.0 + self.random.random() for axis in "XZ"}
            self.go(code, target, f"K{self.random.randint(1, 30) / 10}")
            if code == "G33.1":
                self.at = before
        height = self.random.randint(5, 30) / 10
        first = self.random.uniform(0.1, 0.9) * height
        words = [
            f"P{self.random.randint(1, 30) / 10}",
            f"I{self.number(3.0) or 1.0:.3f}",
            f"J{first:.3f}",
            f"K{height:.3f}",
        ]
        words += self.random.choice([[], [f"R{self.random.randint(10, 25) / 10}"]])
        words += self.random.choice([[], ["Q29.5"]])
        words += self.random.choice([[], [f"H{self.random.randint(0, 3)}"]])
        words += self.random.choice([[], [f"E0.5 L{self.random.randint(0, 3)}"]])
        self.go("G76", {"Z": round(self.at["Z"] + self.random.choice([-1, 1]) * 9.0, 3)}, " ".join(words))
        self.place()

    def probe(self):
        """rs274 comes back a little after a probe, so a place follows that is known."""
        self.place()
        self.go(f"G38.{self.random.randint(2, 5)}", {"Z": self.at["Z"] - 3.0})
        self.lines.append("M66 P1 L0")
        self.place()

    def turning(self):
        """Roughs a contour out and finishes it, outside or inside, in both directions."""
        plane, self.plane = self.plane, "G18"
        self.lines.append("G18")
        self.place()
        towards, out = self.random.choice([-1, 1]), self.random.choice([-1, 1])
        z, x = 0.0, 20.0
        lines = [f"G0 X{x:.3f} Z{z:.3f}", f"G1 Z{z + towards * 1.0:.3f}"]
        z += towards * 1.0
        for _ in range(self.random.randint(1, 4)):
            by_z, by_x = self.random.uniform(2.0, 6.0), self.random.uniform(1.0, 3.0)
            kind = self.random.choice(["line", "steps", "arc"])
            if kind == "steps":
                # Two pieces in one direction are too much for rs274.
                lines += [f"G1 X{x + out * by_x:.4f}", f"Z{z + towards * by_z:.4f}"]
            elif kind == "line":
                lines.append(f"G1 X{x + out * by_x:.4f} Z{z + towards * by_z:.4f}")
            else:
                by_z = by_x
                code = "G2" if towards * out < 0 else "G3"
                lines.append(
                    f"{code} X{x + out * by_x:.4f} Z{z + towards * by_z:.4f} I{out * by_x:.4f} K0"
                )
            z, x = z + towards * by_z, x + out * by_x
        lines.append(f"G1 X{x + out * 0.5:.4f} Z{z + towards * 1.0:.4f}")
        number = 500 + len(self.lines)
        self.lines += [f"o{number} sub", *lines, f"o{number} endsub"]
        begin = f"X{x + out * 2.0:.3f} Z{-towards * 1.0:.3f}"
        left = self.random.choice(["", " D0.3"])
        code = self.random.choice(["G71", "G71.1", "G71.2"])
        self.lines += [
            f"{code} Q{number} {begin} I{self.random.uniform(0.6, 3.0):.3f} R0.3{left}",
            f"G70 Q{number} {begin} P{self.random.randint(1, 2)} D0.2",
            plane,
        ]
        self.plane = plane
        self.place()

    def spline(self):
        """Splines in XY, and a line behind, which tells where they end."""
        self.lines.append("G17")
        self.plane = "G17"

        def end():
            return {axis: round(self.at[axis] + self.number(5.0), 3) for axis in "XY"}

        def ways(letters):
            return " ".join(f"{letter}{self.number(3.0):.3f}" for letter in letters)

        kind = self.random.choice(["G5", "G5.1", "G5.2"])
        if kind == "G5":
            self.go("G5", end(), ways("IJPQ"))
            for _ in range(self.random.randint(0, 2)):
                self.go("G5", end(), ways("PQ"))
        elif kind == "G5.1":
            self.go("G5.1", end(), ways("IJ"))
        else:
            order = self.random.choice([3, 3, 4, 5])
            count = order + self.random.randint(0, 3)
            opening = self.random.choice(["", "P2 ", "P0.5 "])
            self.lines.append(f"G5.2 {opening}L{order}")
            # Under G91 the words of all points are distances from where the curve begins.
            for _ in range(count - 1):
                last = end()
                words = " ".join(self.word(axis, target) for axis, target in last.items())
                self.lines.append(f"{words} P{self.random.randint(2, 30) / 10}")
            self.lines.append("G5.3")
            self.at.update(last)
        self.go("G1", {axis: round(self.at[axis] + 1.0, 3) for axis in "XYZ"})

    def polar(self):
        """Places by radius and angle, and a circle of holes."""
        self.place()
        self.plane = "G17"
        lines = [
            "G17",
            f"G0 @{self.random.randint(20, 90) / 10} ^{self.number(180.0):.2f}",
        ]
        for _ in range(self.random.randint(1, 3)):
            lines.append(
                self.random.choice(
                    [
                        f"G1 ^{self.number(180.0):.2f}",
                        f"G1 @{self.random.randint(20, 90) / 10}",
                        f"G91 G1 @{self.random.randint(1, 9) / 10} ^{self.number(90.0):.2f}",
                        f"G90 G0 @{self.random.randint(20, 90) / 10} ^{self.number(180.0):.2f} Z1",
                    ]
                )
            )
        if self.random.random() < 0.5:
            lines += [f"G98 G91 G81 ^{self.random.randint(10, 80)} Z-2 R-1 L4", "G80"]
        self.lines += lines
        self.place()

    def kept(self):
        """Modes that are saved, changed and restored."""
        self.place()
        units = self.random.choice(["G20", "G21"])
        plane = self.random.choice(list(PLANES))
        self.lines += ["M70", f"{units} {plane} G91", f"G1 X0.1 Y{self.number(0.2):.3f} F7"]
        self.lines += ["G61 G99 G90.1", "M72"]
        self.place()

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
        plain = [writer.straight, writer.arc, writer.arc, writer.modes]
        rare = [
            writer.offset,
            writer.cycle,
            writer.inverse_time,
            writer.outline,
            writer.spline,
            writer.polar,
            writer.kept,
            writer.threads,
            writer.probe,
            writer.turning,
        ]
        writer.random.choice(plain * 3 + rare)()
    writer.lines.append(writer.random.choice(["M2", "M30"]))
    return "\n".join(writer.lines) + "\n"
