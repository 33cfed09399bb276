//! Any bytes as an NC program, for libFuzzer.
#![no_main]

#[path = "../body.rs"]
mod body;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| body::program(bytes));
