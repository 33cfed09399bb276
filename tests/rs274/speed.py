#!/usr/bin/env python3
"""Times `cnc interpret --json` against LinuxCNC's rs274 on four large programs, both as whole
processes that write to nowhere, on one core. What it prints is CPU seconds and their ratio, the
median of some runs each, taken in turn."""

import argparse
import math
import pathlib
import resource
import statistics
import subprocess
import tempfile

HEAD = ["G21 G90 G17 F600"]


def lines(count=1_000_000):
    """A meander of short moves, as engraving programs have them."""
    at = ((k % 2000 * 0.0137, k % 1900 * 0.0119) for k in range(count))
    return [*HEAD, *(f"G1 X{x:.4f} Y{y:.4f}" for x, y in at), "M2"]


def arcs(count=200_000):
    """Arcs of all radii and sweeps, one behind the other."""
    program, x, y = [*HEAD, "G0 X0 Y0"], 0.0, 0.0
    for k in range(count):
        radius, start, sweep = 1 + k % 97 * 0.05, k * 0.7, 1 + k % 5 * 0.5
        if abs(x) > 40 or abs(y) > 40:
            x, y = 0.0, 0.0
            program.append("G0 X0 Y0")
        i, j = round(-radius * math.cos(start), 4), round(-radius * math.sin(start), 4)
        x = round(x + i + radius * math.cos(start + sweep), 4)
        y = round(y + j + radius * math.sin(start + sweep), 4)
        program.append(f"G3 X{x:.4f} Y{y:.4f} I{i:.4f} J{j:.4f}")
    return [*program, "M2"]


def mixed(count=20_000):
    """Pockets and holes, with comments, N words, modal words, arcs, cycles and functions."""
    program = ["%", "(pockets and holes)", *HEAD, "T1 M6", "S8000 M3", "G54"]
    for k in range(count):
        x, y, z = k % 50, k // 50 % 50, k % 9 / 10 + 0.1
        program += [
            f"(pocket {k})",
            f"N{10 * k + 10} G0 X{x:.3f} Y{y:.3f}",
            "Z1",
            f"G1 Z-{z:.2f} F150",
            f"X{x + 0.5:.3f} F600",
            f"G2 X{x + 1:.3f} Y{y + 0.5:.3f} I0 J0.5",
            f"G1 Y{y + 1:.3f}",
            f"X{x:.3f} Y{y:.3f}",
            "G0 Z5",
            f"G81 X{x + 0.25:.3f} Y{y + 0.25:.3f} Z-2 R1 F200",
            "G80",
            "M8",
        ]
    return [*program, "M5", "M2", "%"]


def macro(count=200_000):
    """A spiral, from parameters, expressions and a loop."""
    return [
        *HEAD,
        "#<radius>=20",
        "#1=0",
        f"o100 while [#1 LT {count}]",
        "#2=[#1*0.9]",
        f"G1 X[#<radius>*COS[#2]] Y[#<radius>*SIN[#2]] Z[#1/{count}]",
        "#1=[#1+1]",
        "o100 endwhile",
        "M2",
    ]


def cpu_seconds(command, folder):
    # Parameters would carry over from the run before.
    (folder / "rs274.var").write_text("")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    to = subprocess.DEVNULL
    subprocess.run(command, stdout=to, stderr=to, cwd=folder, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rs274", type=pathlib.Path, required=True)
    parser.add_argument("--cnc", type=pathlib.Path, required=True)
    parser.add_argument("--runs", type=int, default=3)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "tool.tbl").write_text("T1 P1 D3 Z0\n")
        reference = [arguments.rs274.resolve(), "-g", "-t", "tool.tbl", "-v", "rs274.var"]
        ours = [arguments.cnc.resolve(), "interpret", "--json", "-q", "--machine", "ideal"]
        print(f"{'':8}{'rs274':>9}{'cnc':>9}{'ratio':>8}")
        for program in (lines, arcs, mixed, macro):
            file = folder / f"{program.__name__}.ngc"
            file.write_text("\n".join(program()) + "\n")
            pairs = [
                (cpu_seconds([*reference, file], folder), cpu_seconds([*ours, file], folder))
                for _ in range(arguments.runs)
            ]
            theirs, own = (statistics.median(times) for times in zip(*pairs))
            ratio = statistics.median(a / b for a, b in pairs)
            print(f"{program.__name__:8}{theirs:7.2f} s{own:7.2f} s{ratio:8.1f}", flush=True)


if __name__ == "__main__":
    main()
