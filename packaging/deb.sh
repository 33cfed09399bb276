#!/usr/bin/env bash
# Makes the Debian package, and prints its path: target/debian/cnc_*.deb. Needs cargo-deb.
# Usage: packaging/deb.sh [TARGET [PROFILE]]
# CNC_HERE names a `cnc` that runs on this computer, for a TARGET that does not.
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/epoch.sh
target=${1:-x86_64-unknown-linux-musl}
profile=${2:-release}
binary=$(packaging/build.sh "$target" "$profile")
# Pages and completions are the same on all computers: they are made by a binary that runs on this one.
packaging/assets.sh "${CNC_HERE:-$binary}"
# Debian's form of a changelog; its one entry has the time of the commit.
version=$(sed -n '/^version = /{s/.*"\(.*\)"/\1/p;q}' Cargo.toml)
maintainer=$(sed -n 's/^maintainer = "\(.*\)"/\1/p' Cargo.toml)
cat > target/package-assets/changelog <<ENTRY
cnc ($version-1) unstable; urgency=medium

  * Version $version: see CHANGELOG.md.

 -- $maintainer  $(LC_ALL=C date --utc --date="@$SOURCE_DATE_EPOCH" --rfc-email)
ENTRY
mkdir -p target/debian
cargo deb --no-build --no-strip --target "$target" --profile "$profile" --output target/debian/
