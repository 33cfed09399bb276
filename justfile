# What people do here every day; `just` lists it.

default:
    @just --list

# Everything that CI does
ci:
    .ci/run

# Format, then look for what clippy finds
tidy:
    cargo fmt
    cargo clippy --all-targets -- -D warnings

# Hold the steps of every sample against its program
samples:
    samples/ci/check-folder.sh samples/good

# Measure parsing, interpolation and dump writing
bench:
    cargo bench
