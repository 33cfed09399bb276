#!/usr/bin/env python3
"""Runs programs through LinuxCNC's rs274 and through `cnc interpret`, and compares their moves.

A sample that rs274 cannot read (`*`, GR, files that need its O-word syntax) is counted and told;
a generated program that one of the two refuses is a failure."""

import argparse
import pathlib
import subprocess
import sys
import tempfile

import canon
import macros
import programs

TOOLS = "T1 P1 D3 Z0\nT2 P2 D6 Z0\n"


def run_reference(rs274, file, folder):
    # The parameters, offsets among them, would carry over from the program before.
    (folder / "rs274.var").unlink(missing_ok=True)
    command = [rs274, "-g", "-t", folder / "tool.tbl", "-v", folder / "rs274.var", file]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60, cwd=folder)
    return canon.reference(result.stdout) if result.returncode == 0 else None


def run_ours(cnc, file):
    command = [cnc, "interpret", "--json", "-q", "--machine", "ideal", file]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60)
    return canon.ours(result.stdout) if result.returncode == 0 else None


def difference(expected, found, text):
    """The first move that differs, in words; none if all agree."""
    expected, found = canon.without_rests(expected), canon.without_rests(found)
    close_mm = canon.CLOSE_TURNED_MM if "G70" in text else canon.CLOSE_MM
    for at, (a, b) in enumerate(zip(expected, found)):
        if not canon.same(a, b, close_mm):
            return f"move {at}: rs274 has {a}; cnc has {b}"
    if len(expected) != len(found):
        return f"rs274 has {len(expected)} moves, cnc {len(found)}"
    return None


def check(arguments, file, folder, generated):
    """One program; says what differs. Gives moves compared, or none where it was not compared."""
    expected, found = run_reference(arguments.rs274, file, folder), run_ours(arguments.cnc, file)
    if expected is None or found is None:
        who = [name for name, moves in (("rs274", expected), ("cnc", found)) if moves is None]
        if generated:
            raise SystemExit(f"{file.name}: refused by {' and '.join(who)}\n{file.read_text()}")
        print(f"{file.name}: not compared, refused by {' and '.join(who)}")
        return None
    text = file.read_text()
    differs = difference(expected, found, text)
    if differs:
        raise SystemExit(f"{file.name}: {differs}" + (f"\n{text}" if generated else ""))
    return len(expected)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rs274", type=pathlib.Path, required=True)
    parser.add_argument("--cnc", type=pathlib.Path, required=True)
    parser.add_argument("--programs", type=int, default=200, help="of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("files", nargs="*", type=pathlib.Path)
    arguments = parser.parse_args()
    compared, moves = 0, 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "tool.tbl").write_text(TOOLS)
        work = [(file.resolve(), False) for file in arguments.files]
        for seed in range(arguments.seed, arguments.seed + arguments.programs):
            for kind in (programs, macros):
                file = folder / f"{kind.__name__}-{seed}.ngc"
                file.write_text(kind.generate(seed))
                work.append((file, True))
        for file, generated in work:
            count = check(arguments, file, folder, generated)
            if count is not None:
                compared, moves = compared + 1, moves + count
    if compared < 2 * arguments.programs:
        sys.exit("fewer programs were compared than asked for")
    print(f"{compared} programs, {moves} moves: the same as rs274")


if __name__ == "__main__":
    main()
