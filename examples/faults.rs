//! Runs short jobs on virtual nodes, one fault each, and holds them to the rule of docs/bus.md:
//! `cargo run --release --example faults -- --seeds 10000`. Prints what was seen how often, and every
//! seed that breaks the rule; `--from 42 --seeds 1` runs that one again and shows it.

use std::collections::BTreeMap;
use std::io::{Write, stdout};
use std::process::ExitCode;

#[path = "../tests/faults/rule.rs"]
mod rule;

fn main() -> ExitCode {
    let mut options = BTreeMap::from([("--seeds", 1000_u64), ("--from", 0), ("--entries", 40)]);
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let value = words.next().and_then(|value| value.parse().ok());
        let option = options.iter_mut().find(|(name, _)| **name == word);
        match (option, value) {
            (Some((_, place)), Some(value)) => *place = value,
            _ => {
                let usage = "expected --seeds N, --from N, --entries N (even, at least 20)";
                writeln!(std::io::stderr(), "{usage}").ok();
                return ExitCode::from(2);
            }
        }
    }
    let (from, seeds) = (options["--from"], options["--seeds"]);
    let mut seen: BTreeMap<String, u64> = BTreeMap::new();
    let mut breaches = 0;
    let mut out = stdout().lock();
    for seed in from..from + seeds {
        let ran = rule::run(seed, options["--entries"] as u32);
        rule::seen(&ran).into_iter().for_each(|what| *seen.entry(what).or_default() += 1);
        let verdict = rule::judge(&ran);
        if verdict.is_err() || seeds == 1 {
            let faults: Vec<_> = ran.faults.iter().map(ToString::to_string).collect();
            writeln!(
                out,
                "seed {}: {verdict:?}, {}, {:#?}",
                ran.seed,
                faults.join("+"),
                ran.ending
            )
            .ok();
            breaches += u64::from(verdict.is_err());
        }
        if seeds == 1 {
            ran.log.iter().for_each(|entry| {
                writeln!(out, "{entry:?}").ok();
            });
        }
    }
    for (what, count) in &seen {
        writeln!(out, "{count:8} {what}").ok();
    }
    writeln!(out, "{breaches} of {seeds} seeds break the rule").ok();
    if breaches == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
