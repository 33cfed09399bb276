#!/bin/sh
# Checks thousands of programs on many computers at once: each is interpolated, held against its path and
# proved for the bus, and all results come together on one page.
#
#   samples/ci/farm.sh HOSTS FOLDER RESULTS [OPTIONS OF CNC, as --machine router]
#
# HOSTS is a file with a line a computer, as GNU parallel takes it (--sshloginfile): `user@host`, `8/host`
# for eight jobs at once, `:` for this one. Each has `cnc`, and is reached by ssh without a password; the
# programs are sent there. Files that these options name have to be on each.
# RESULTS is made anew: a document a program, and what its job said; farm.html and farm.json sum them up.
#
# Exit: 0 all pass, 1 a program does not, 2 a result is broken or missing, or usage.
# CNC names the program to use; without it: cnc on the PATH.
set -eu

if [ $# -lt 3 ] || [ ! -f "$1" ] || [ ! -d "$2" ]; then
    echo "usage: $0 HOSTS FOLDER RESULTS [OPTIONS OF CNC]" >&2
    exit 2
fi
if ! parallel --version 2>/dev/null | grep -q '^GNU parallel'; then
    echo "$0: GNU parallel is needed: apt-get install parallel" >&2
    exit 2
fi
hosts=$1
folder=${2%/}
results=$3
shift 3
CNC=${CNC:-cnc}

if ! grep -q '[^[:space:]]' "$hosts"; then
    echo "$0: $hosts names no computer: : is this one" >&2
    exit 2
fi
if [ -e "$results" ]; then
    echo "$0: $results is there already: results of two runs are not mixed" >&2
    exit 2
fi
mkdir -p "$results/programs"
find "$folder" -mindepth 1 -name '.*' -prune -o -xtype f \( -iname '*.nc' -o -iname '*.ngc' -o -iname '*.gcode' \
    -o -iname '*.gc' -o -iname '*.cnc' -o -iname '*.tap' -o -iname '*.eia' \) -print |
    LC_ALL=C sort >"$results/programs.txt"
if [ ! -s "$results/programs.txt" ]; then
    echo "$folder holds no NC program (*.nc, *.ngc, *.gcode, *.gc, *.cnc, *.tap, *.eia)" >&2
    exit 2
fi

# Words of the command line as the shell of a host reads them.
words() {
    for word; do printf '%s\n' "$word"; done | parallel --will-cite --keep-order --shellquote | tr '\n' ' '
}

# A program that does not pass is a result like others. What ends otherwise (no `cnc` there, a host that is
# lost) is tried on other hosts, three times in all, and told where it stays so.
parallel --will-cite --sshloginfile "$hosts" --transferfile {} --cleanup --retries 3 \
    --joblog "$results/jobs.tsv" --results "$results/programs/{#}.jsonl" \
    "$(words "$CNC") report {} --json --quiet $(words "$@") || [ \$? -le 2 ]" \
    <"$results/programs.txt" >"$results/parallel.out" 2>&1 || true

code=0
"$CNC" report --merge "$results/programs" --expected "$results/programs.txt" \
    -o "$results/farm.html" --json >"$results/farm.json" || code=$?
exit "$code"
