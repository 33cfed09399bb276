//! Whole jobs on virtual nodes with a fault each, from seeds: the rule holds, and everything that can
//! go wrong has.

use std::collections::BTreeSet;

use cnc::wire::{FaultKind, FaultSpec, Phase, Who};

#[path = "faults/rule.rs"]
mod rule;

/// Entries of a node's buffer in these tests: short jobs have all phases too.
const ENTRIES: u32 = 40;

fn judge(ran: &rule::Ran) {
    if let Err(breach) = rule::judge(ran) {
        let faults: Vec<_> = ran.faults.iter().map(ToString::to_string).collect();
        panic!("seed {}, {}: {breach}\n{:#?}", ran.seed, faults.join("+"), ran.ending);
    }
}

/// Each fault at the first and at a later place of each phase, for all nodes and for one.
fn every_fault() -> Vec<FaultSpec> {
    use FaultKind::*;
    let kinds = [
        Drop,
        Change(0x02),
        Change(0x55),
        Add(0),
        Add(b'h'),
        Add(122),
        Late(900),
        Late(300_000),
        LoseAnswer,
        ChangeAnswer(0x10),
        DoubleAnswer,
        LateAnswer(20_000),
        LateAnswer(300_000),
        Collide,
        Dead,
        Stall(15_000),
        Stall(300_000),
        Reset,
        Overrun,
        Close,
    ];
    let mut faults = Vec::new();
    for kind in kinds {
        for phase in Phase::ALL {
            if kind.is_of_answer() && phase == Phase::Start {
                continue;
            }
            let alone = matches!(kind, Drop | Change(_) | Add(_));
            let whos: &[_] = match (kind.needs_node(), alone) {
                (true, _) => &[Some(Who::Axis(cnc::base::Axis::Y))],
                (false, true) => &[None, Some(Who::Axis(cnc::base::Axis::X))],
                (false, false) => &[None],
            };
            let later = match phase {
                Phase::Command if kind.is_of_answer() => 0,
                Phase::Data if kind.is_of_answer() => 0,
                Phase::Start | Phase::Command => 1,
                Phase::Ping if kind.is_of_answer() => 2,
                Phase::Ping | Phase::Pad => 3,
                Phase::Tick => 4,
                Phase::Data => 7,
            };
            for who in whos {
                let places = BTreeSet::from([0, later]);
                let phase = Some(phase);
                faults.extend(places.iter().map(|at| FaultSpec {
                    kind,
                    who: *who,
                    phase,
                    number: *at,
                }));
            }
        }
    }
    faults
}

#[test]
fn the_rule_holds_for_every_fault_at_every_phase() {
    let mut seen = BTreeSet::new();
    for (seed, fault) in (1..).zip(every_fault()) {
        let ran = rule::run_with(seed, ENTRIES, false, |_| vec![fault]);
        assert_eq!(ran.struck.len(), 1, "seed {seed}: {fault} has not struck");
        judge(&ran);
        seen.extend(rule::seen(&ran));
    }
    // A person stops the job before the host can find out that a servant has missed a tick.
    for seed in 0..20 {
        let fault = "drop:Z@tick.0".parse().unwrap();
        let ran = rule::run_with(seed, ENTRIES, true, |_| vec![fault]);
        judge(&ran);
        seen.extend(rule::seen(&ran));
    }
    for seed in 0..250 {
        let ran = rule::run(seed, ENTRIES);
        judge(&ran);
        seen.extend(rule::seen(&ran));
    }
    let mut unseen: Vec<String> = expected().filter(|what| !seen.contains(what)).collect();
    unseen.sort();
    assert_eq!(unseen, Vec::<String>::new(), "never seen; what was: {seen:#?}");
}

/// Faults and where they strike, what the host may find, say of positions, and what nodes may do.
fn expected() -> impl Iterator<Item = String> {
    let faults = every_fault()
        .into_iter()
        .filter_map(|fault| Some(format!("{} at {}", fault.kind.name(), fault.phase?.name())));
    let other = [
        "hazard: is deaf until it is switched off",
        "hazard: took another node's data for a command to move",
        "hazard: was still stepping when the next tick came: the axes drift apart",
        "host: done",
        "host: early",
        "host: event between buffers failed",
        "host: event within a buffer failed",
        "host: interrupted",
        "host: no answer to command",
        "host: no answer to data",
        "host: no answer to ping",
        "host: no answer to tick",
        "host: port",
        "host: unexpected",
        "host: wrong answer to command",
        "host: wrong answer to data",
        "host: wrong answer to ping",
        "host: wrong answer to tick",
        "node: fill, master false",
        "node: fill, master true",
        "node: finished",
        "node: full",
        "node: homes",
        "node: jog, ping false",
        "node: jog, ping true",
        "node: overrun",
        "node: starts",
        "node: sync waited",
        "position: known, and right",
        "position: known-until-power-off, and right",
        "position: unconfirmed, and right",
        "position: unconfirmed, and wrong",
        "position: unknown, and right",
        "position: unknown, and wrong",
        "power cycle: false",
        "power cycle: true",
        "replay: an answer is missing",
        "replay: an answer too many",
        "replay: another answer",
        "replay: the same",
    ];
    faults.chain(other.map(str::to_owned))
}
