#!/usr/bin/env bash
# Makes what packages hold beside the binary: manual pages and completions.
# Usage: packaging/assets.sh CNC [FOLDER]
set -euo pipefail
cnc=$(realpath "$1")
folder=${2:-$(dirname "$0")/../target/package-assets}
rm -rf "$folder"
mkdir -p "$folder/man" "$folder/completions"
"$cnc" man -o "$folder/man"
gzip -9n "$folder"/man/*.1
"$cnc" completions bash > "$folder/completions/cnc"
"$cnc" completions zsh > "$folder/completions/_cnc"
"$cnc" completions fish > "$folder/completions/cnc.fish"
