#!/usr/bin/env bash
# Holds `cnc interpret` against LinuxCNC's own interpreter, rs274, over generated programs and the
# good samples: every coordinate to 1e-6 mm. Usage: tests/rs274/run.sh [PROGRAMS] [SEED]
set -euo pipefail
. "$(dirname "$0")/fetch.sh"
exec python3 "$here/compare.py" \
    --rs274 "$exact" --cnc "${CNC:-$root/target/debug/cnc}" \
    --programs "${1:-200}" --seed "${2:-1}" "$root"/samples/good/*.nc
