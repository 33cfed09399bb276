#!/usr/bin/env bash
# Times `cnc interpret --json` against LinuxCNC's rs274 over four large programs: some minutes, and
# no test. Usage: tests/rs274/speed.sh [RUNS], after cargo build --release
set -euo pipefail
. "$(dirname "$0")/fetch.sh"
exec taskset -c 0 python3 "$here/speed.py" \
    --rs274 "$rs274" --cnc "${CNC:-$root/target/release/cnc}" --runs "${1:-3}"
