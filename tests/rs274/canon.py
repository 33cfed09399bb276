"""Motion as LinuxCNC's rs274 prints it (canonical calls) and as `cnc interpret --json` prints it,
brought to one form: moves in mm and machine coordinates."""

import json
import math
import re
from dataclasses import dataclass

CALL = re.compile(r"^\s*\d+ N\S+\s+(\w+)\((.*)\)\s*$")
PLANES = {"CANON_PLANE_XY": "XY", "CANON_PLANE_YZ": "YZ", "CANON_PLANE_XZ": "ZX"}
# Where ARC_FEED's first, second and across coordinates belong, by plane.
ARC_AXES = {"XY": (0, 1, 2), "YZ": (1, 2, 0), "ZX": (2, 0, 1)}
# How far places may lie apart, in mm; both sides print nine decimals or more.
CLOSE_MM = 1e-6
# And in contours that are turned: where two arcs touch, a rounding of 1e-14 moves the place where they meet
# by the root of it, and either side has such places.
CLOSE_TURNED_MM = 2e-6
# A straight move shorter than this is none: roundings close such gaps on one side alone.
REST_MM = 1e-5


@dataclass
class Move:
    """One move or dwell: kind, end point, and what belongs to the kind."""

    kind: str
    to: tuple = ()
    feed: float = 0.0
    center: tuple = ()
    plane: str = ""
    turns: int = 0
    seconds: float = 0.0
    # Control points of a spline. The reference prints no more of it: where it ends is told by the
    # move that follows.
    points: int = 0

    def __str__(self):
        parts = [self.kind]
        if self.to:
            parts.append("to " + " ".join(f"{value:.7f}" for value in self.to))
        if self.center:
            parts.append(f"{self.plane} centre {self.center[0]:.7f} {self.center[1]:.7f}")
            parts.append(f"turns {self.turns}")
        if self.points:
            parts.append(f"{self.points} points, feed {self.feed:.4f}")
        parts.append(f"feed {self.feed:.4f}" if self.to else f"{self.seconds} s")
        return ", ".join(parts)


class Canon:
    """Follows rs274's canonical calls: offsets, rotation and units are applied here."""

    def __init__(self):
        self.scale = 1.0
        self.plane = "XY"
        self.feed = 0.0
        self.rpm = 0.0
        # Along the path a turn of the spindle, in mm, while moves follow its turns.
        self.pitch = None
        self.g5x = [0.0] * 3
        self.g92 = [0.0] * 3
        self.tool = [0.0] * 3
        self.rotation = 0.0
        self.moves = []

    def machine(self, point):
        """Machine coordinates of a point in program coordinates, all in mm."""
        x, y, z = (value + offset for value, offset in zip(point, self.g92))
        cos, sin = math.cos(self.rotation), math.sin(self.rotation)
        x, y = x * cos - y * sin, x * sin + y * cos
        return tuple(v + o + t for v, o, t in zip((x, y, z), self.g5x, self.tool))

    def call(self, name, arguments):
        numbers = [float(a) for a in arguments if re.fullmatch(r"[-+]?\d*\.?\d+", a)]
        mm = [value * self.scale for value in numbers]
        if name == "USE_LENGTH_UNITS":
            self.scale = 25.4 if "INCHES" in arguments[0] else 1.0
        elif name == "SELECT_PLANE":
            self.plane = PLANES[arguments[0]]
        elif name == "SET_FEED_RATE":
            self.feed = mm[0]
        elif name == "SET_G5X_OFFSET":
            self.g5x = mm[1:4]
        elif name == "SET_G92_OFFSET":
            self.g92 = mm[0:3]
        elif name == "USE_TOOL_LENGTH_OFFSET":
            self.tool = mm[0:3]
        elif name == "SET_XY_ROTATION":
            self.rotation = math.radians(numbers[0])
        elif name == "DWELL":
            self.moves.append(Move("dwell", seconds=numbers[0]))
        elif name == "STRAIGHT_TRAVERSE":
            self.add("rapid", mm[0:3])
        elif name in ("STRAIGHT_FEED", "STRAIGHT_PROBE"):
            feed = self.feed if self.pitch is None else self.pitch * self.rpm
            self.add("line", mm[0:3], feed=feed)
        elif name == "SET_SPINDLE_SPEED":
            self.rpm = numbers[1]
        elif name == "START_SPEED_FEED_SYNC":
            self.pitch = mm[0]
        elif name == "STOP_SPEED_FEED_SYNCH":
            self.pitch = None
        elif name == "RIGID_TAP":
            back = self.moves[-1].to if self.moves else (0.0, 0.0, 0.0)
            feed = self.pitch * self.rpm
            self.add("line", mm[0:3], feed=feed)
            self.moves.append(Move("line", to=back, feed=feed))
        elif name == "ARC_FEED":
            self.arc(numbers, mm)
        elif name == "NURBS_FEED":
            self.moves.append(Move("spline", points=int(numbers[0]), feed=self.feed))

    def arc(self, numbers, mm):
        first, second, across = ARC_AXES[self.plane]
        end, center = [0.0] * 3, [0.0] * 3
        end[first], end[second], end[across] = mm[0], mm[1], mm[5]
        center[first], center[second] = mm[2], mm[3]
        center = self.machine(center)
        turns = int(numbers[4])
        kind = "arc ccw" if turns > 0 else "arc cw"
        self.add(
            kind,
            end,
            feed=self.feed,
            plane=self.plane,
            center=(center[first], center[second]),
            turns=abs(turns) - 1,
        )

    def add(self, kind, point, **more):
        self.moves.append(Move(kind, to=self.machine(point), **more))


def reference(text):
    """Moves of rs274's output, or none if it refused the program."""
    canon = Canon()
    for line in text.splitlines():
        match = CALL.match(line)
        if match:
            arguments = [a.strip() for a in match.group(2).replace(" ", ",").split(",")]
            canon.call(match.group(1), [a for a in arguments if a])
    return canon.moves


def ours(text):
    """Moves of `cnc interpret --json`."""
    moves = []
    for line in text.splitlines():
        item = json.loads(line)
        if item["type"] == "dwell":
            moves.append(Move("dwell", seconds=item["seconds"]))
        if "to" not in item:
            continue
        to = tuple(item["to"][axis] for axis in "XYZ")
        move = Move(item["type"], to=to, feed=item.get("feed", 0.0))
        if item["type"] == "arc":
            move.kind = "arc ccw" if item["ccw"] else "arc cw"
            move.plane = item["plane"]
            move.center = tuple(item["center"][axis] for axis in item["plane"])
            move.turns = item["turns"]
        if item["type"] == "spline":
            move.to, move.points = (), len(item["points"])
        moves.append(move)
    return moves


def without_rests(moves):
    """Straight moves that go nowhere left out: the two differ in whether they say them."""
    kept, at = [], (0.0, 0.0, 0.0)
    for move in moves:
        straight = move.kind in ("rapid", "line")
        if not (straight and math.dist(move.to, at) < REST_MM):
            kept.append(move)
        at = move.to or at
    return kept


def same(a, b, close_mm):
    """Whether two moves agree, in places to some mm."""
    points = a.to + a.center, b.to + b.center
    return (
        (a.kind, a.plane, a.turns, a.points) == (b.kind, b.plane, b.turns, b.points)
        and len(points[0]) == len(points[1])
        and all(abs(x - y) <= close_mm for x, y in zip(*points))
        and abs(a.seconds - b.seconds) <= 1e-6
        # The reference prints the lead of a thread with six decimals.
        and abs(a.feed - b.feed) <= CLOSE_MM + 1e-5 * b.feed
    )
