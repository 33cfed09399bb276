#!/usr/bin/env bash
# Holds a binary against what is promised of it: it asks for no library, and does a job.
# Usage: packaging/check-static.sh CNC [RUNNER…], RUNNER as qemu-aarch64-static
set -euo pipefail
cnc=$(realpath "$1")
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
