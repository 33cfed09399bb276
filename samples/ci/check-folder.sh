#!/bin/sh
# Checks the interpolation error of every NC program in a folder, not in those below it: each is interpolated to steps,
# and the steps are held against the programmed path. Prints a line a program.
#
#   samples/ci/check-folder.sh FOLDER [OPTIONS OF CNC, as --machine router]
#
# Exit: 0 all within tolerance, 1 a program is refused or out of tolerance, 2 usage.
# CNC names the program to use; without it: cnc on the PATH, or this repository's release build.
set -eu

if [ $# -lt 1 ] || [ ! -d "$1" ]; then
    echo "usage: $0 FOLDER [OPTIONS OF CNC]" >&2
    exit 2
fi
folder=$1
shift

if [ -z "${CNC:-}" ] && ! CNC=$(command -v cnc); then
    root=$(cd "$(dirname "$0")/../.." && pwd)
    (cd "$root" && cargo build --quiet --release)
    CNC=${CARGO_TARGET_DIR:-$root/target}/release/cnc
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# The number that a key of a one-line JSON document has.
number() {
    sed -n "s/.*\"$1\":\(-\{0,1\}[0-9.eE+-]*\).*/\1/p" "$work/verdict"
}

# How one program does: sets $result and $detail.
check() {
    program=$1
    shift
    result=FAIL
    if ! "$CNC" interpolate "$program" --csv -o "$work/dump.csv" "$@" 2>"$work/messages" >/dev/null; then
        detail=$(grep -m 1 -i error "$work/messages" || echo "could not be interpolated")
        return
    fi
    if "$CNC" verify "$program" "$work/dump.csv" --json "$@" >"$work/verdict" 2>"$work/messages"; then
        result=ok
    fi
    error=$(number max_contour_error_mm)
    if [ -z "$error" ]; then
        result=FAIL
        detail=$(head -n 1 "$work/messages")
        return
    fi
    detail="max contour error $error mm, tolerance $(number tolerance_mm) mm, $(number ticks) ticks"
}

checked=0
failed=0
for program in "$folder"/*; do
    case $program in
        *.[nN][cC] | *.[nN][gG][cC] | *.[gG][cC][oO][dD][eE] | *.[gG][cC]) ;;
        *.[cC][nN][cC] | *.[tT][aA][pP] | *.[eE][iI][aA]) ;;
        *) continue ;;
    esac
    check "$program" "$@"
    checked=$((checked + 1))
    [ "$result" = ok ] || failed=$((failed + 1))
    printf '%-4s  %-40s %s\n' "$result" "${program##*/}" "$detail"
done

if [ "$checked" -eq 0 ]; then
    echo "$folder holds no NC program (*.nc, *.ngc, *.gcode, *.gc, *.cnc, *.tap, *.eia)" >&2
    exit 2
fi
echo "$((checked - failed)) of $checked programs within tolerance"
[ "$failed" -eq 0 ]
