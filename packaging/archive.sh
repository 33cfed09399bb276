#!/usr/bin/env bash
# Makes the archive of a release, and prints its path: cnc-VERSION-TARGET.tar.gz in target/archives/.
# Usage: packaging/archive.sh [TARGET [PROFILE]]
# CNC_HERE names a `cnc` that runs on this computer, for a TARGET that does not.
set -euo pipefail
cd "$(dirname "$0")/.."
. packaging/epoch.sh
target=${1:-x86_64-unknown-linux-musl}
profile=${2:-release}
binary=$(packaging/build.sh "$target" "$profile")
version=$(sed -n '/^version = /{s/.*"\(.*\)"/\1/p;q}' Cargo.toml)
name=cnc-$version-$target

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/$name"
packaging/assets.sh "${CNC_HERE:-$binary}" "$work/$name/share"
rustc --version --verbose > "$work/$name/rustc-version.txt"
cp "$binary" LICENSE-MIT LICENSE-APACHE README.md CHANGELOG.md packaging/60-cnc.rules "$work/$name"

# Order, owners, modes and times of the files are those of the release, not of this computer.
mkdir -p target/archives
archive=target/archives/$name.tar.gz
tar --sort=name --owner=0 --group=0 --numeric-owner --mode=u=rwX,go=rX --mtime="@$SOURCE_DATE_EPOCH" \
    -C "$work" -cf - "$name" | gzip -9n > "$archive"
echo "$archive"
