# Sourced by the scripts beside it: fetches two Debian packages into target/rs274 and unpacks them
# there; installs nothing. Sets `root`, `here`, `rs274`, the interpreter, and `exact`, the same with nine
# decimals in what it prints in place of four, which are too few to hold anyone to 1e-6 mm.
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$here/../..
store=${CARGO_TARGET_DIR:-$root/target}/rs274
rs274=$store/usr/bin/rs274
exact=$store/usr/bin/rs274-exact
if [ ! -x "$rs274" ]; then
    mkdir -p "$store"
    cd "$store"
    packages=(linuxcnc-uspace libboost-python1.74.0)
    apt-get download -qq "${packages[@]}" ||
        { apt-get update -qq && apt-get download -qq "${packages[@]}"; } || exit 77
    for package in *.deb; do dpkg -x "$package" .; done
    cd "$OLDPWD"
fi
if [ ! -x "$exact" ]; then
    # Formats of printf inside the binary; the new ones are as long.
    sed 's/%\.4f/%.9f/g' "$rs274" >"$exact.new"
    chmod +x "$exact.new"
    mv "$exact.new" "$exact"
fi
export LD_LIBRARY_PATH=$store/usr/lib:$store/usr/lib/x86_64-linux-gnu
