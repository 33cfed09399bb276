#!/usr/bin/env bash
# Builds a release the same way everywhere: the same sources, Rust and target give the same bytes in
# any folder. Usage: packaging/build.sh [TARGET [PROFILE]]; prints the path of the binary.
set -euo pipefail
cd "$(dirname "$0")/.."
target=${1:-x86_64-unknown-linux-musl}
profile=${2:-release}

# Folders end up in messages of panics: name them alike.
home=${CARGO_HOME:-$HOME/.cargo}
flags="--remap-path-prefix=$PWD=/cnc --remap-path-prefix=$home=/cargo -C strip=symbols"
case $target in
    # What the installed target needs for a binary that asks for no library.
    *-gnu) flags+=" -C target-feature=+crt-static" ;;
    # Rust brings what a static musl binary needs, and a linker: no C compiler for these targets.
    *-musl*) flags+=" -C linker=rust-lld -C link-self-contained=yes" ;;
esac
export RUSTFLAGS=$flags
. packaging/epoch.sh

cargo build --quiet --locked --bin cnc --profile "$profile" --target "$target" >&2
folder=$profile
[ "$profile" = dev ] && folder=debug
echo "${CARGO_TARGET_DIR:-target}/$target/$folder/cnc"
