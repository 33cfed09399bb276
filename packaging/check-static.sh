#!/usr/bin/env bash
# Holds a binary against what is promised of it: it asks for no library, and does a job.
# Usage: packaging/check-static.sh CNC [RUNNER…], RUNNER as qemu-aarch64-static
# CNC_HERE names a `cnc` that runs on this computer: then both have to make the same dumps.
set -euo pipefail
cnc=$(realpath "$1")
here=${CNC_HERE:+$(realpath "$CNC_HERE")}
shift
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Segments of kind INTERP name a loader, as any binary has that asks for libraries.
kind=$(file -b "$cnc")
case $kind in
    *"statically linked"* | *"static-pie linked"*) echo "static: $kind" ;;
    *) echo "not static: $kind" >&2; exit 1 ;;
esac
if [ $# -eq 0 ] && ldd "$cnc" >"$work/ldd" 2>&1 && ! grep -q "statically linked" "$work/ldd"; then
    echo "asks for libraries:" >&2
    cat "$work/ldd" >&2
    exit 1
fi

"$@" "$cnc" interpolate samples/good/planes.nc --csv -o "$work/planes.csv"
"$@" "$cnc" verify samples/good/planes.nc "$work/planes.csv" -q
env -i "$@" "$cnc" send sim: samples/good/planes.nc -q
"$@" "$cnc" plot samples/good/planes.nc -o "$work/planes.png"

# Dumps are the same on every computer, to the byte.
[ -n "$here" ] || exit 0
for program in samples/good/*.nc; do
    "$@" "$cnc" interpolate "$program" --csv -o "$work/there.csv" -q
    "$here" interpolate "$program" --csv -o "$work/here.csv" -q
    cmp "$work/there.csv" "$work/here.csv"
done
echo "the same dumps as $CNC_HERE"
