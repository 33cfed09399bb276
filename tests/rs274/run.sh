#!/usr/bin/env bash
# Holds `cnc interpret` against LinuxCNC's own interpreter, rs274, over generated programs and the
# good samples. Fetches two Debian packages into target/rs274 and unpacks them there; installs
# nothing. Usage: tests/rs274/run.sh [PROGRAMS] [SEED]
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$here/../..
store=${CARGO_TARGET_DIR:-$root/target}/rs274
if [ ! -x "$store/usr/bin/rs274" ]; then
    mkdir -p "$store"
    cd "$store"
    packages=(linuxcnc-uspace libboost-python1.74.0)
    apt-get download -qq "${packages[@]}" ||
        { apt-get update -qq && apt-get download -qq "${packages[@]}"; } || exit 77
    for package in *.deb; do dpkg -x "$package" .; done
    cd "$OLDPWD"
fi
export LD_LIBRARY_PATH=$store/usr/lib:$store/usr/lib/x86_64-linux-gnu
exec python3 "$here/compare.py" \
    --rs274 "$store/usr/bin/rs274" --cnc "${CNC:-$root/target/debug/cnc}" \
    --programs "${1:-200}" --seed "${2:-1}" "$root"/samples/good/*.nc
