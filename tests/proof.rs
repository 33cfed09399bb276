//! The proof that a job is safe for the bus, held against nodes that hear its bytes; and the order of
//! filling against all orders.

use std::collections::BTreeMap;

use cnc::base::machine::{Protocol, Unit};
use cnc::base::{Axis, AxisMap, Command, Machine, Tick};
use cnc::wire::{Buffer, Fill, Job, JobError, Nodes, Step, codec, lint};
use proptest::prelude::*;

/// Entries of a node's buffer here.
const ENTRIES: u32 = 8;

/// Bytes come so far apart that timing plays no part.
const APART_US: u64 = 1_000_000;

fn machine(ids: &[u8], spare: &[u8]) -> Machine {
    let mut machine = Machine::load("starmill").unwrap();
    machine.bus.buffer_ticks = ENTRIES;
    machine.bus.nodes = Axis::ALL.into_iter().zip(ids.iter().copied()).collect();
    machine.bus.spare_ids = spare.to_vec();
    machine
}

fn job(machine: &Machine, buffers: Vec<Vec<Fill>>) -> Job {
    let start_steps = machine.nearest_steps(&machine.work_zero_mm);
    let mut job = Job::new([], start_steps, machine).unwrap();
    job.nodes = machine.bus.units().collect();
    for (number, fills) in (0..).zip(buffers) {
        let lines = vec![number + 1; ENTRIES as usize];
        let (protocol, events) = (Protocol::Buffered, Vec::new());
        job.steps.push(Step::Buffer(Buffer { protocol, number, fills, lines, events }));
    }
    job
}

/// Whether a node takes anything for a command that is not meant for it, when it hears all bytes of a
/// job in the order of sending.
fn hazard(machine: &Machine, job: &Job) -> bool {
    let start = AxisMap::from_fn(|_| 100_000);
    let mut nodes = Nodes::new(machine, machine.bus.units(), &start, APART_US);
    let mut now_us = 0;
    for buffer in job.buffers() {
        let mut bytes = Vec::new();
        for Fill { unit, master, bytes: data } in &buffer.fills {
            bytes.extend([b'j', unit.id, unit.id, 0, b's', b's']);
            bytes.extend([unit.id, if *master { unit.id } else { 0 }]);
            bytes.extend(data);
        }
        bytes.extend([120, 0]);
        bytes.extend([0; ENTRIES as usize]);
        for byte in bytes {
            now_us += APART_US;
            nodes.handle_bytes(now_us, &[byte]);
        }
        nodes.advance(now_us + APART_US);
    }
    let mut seen = false;
    while let Some(entry) = nodes.poll_log() {
        seen |= entry.hazard.is_some();
    }
    seen
}

/// Counts as data holds them, and commands more often than chance would have it.
fn byte() -> impl Strategy<Value = u8> {
    prop_oneof![
        6 => (-7..8).prop_map(|count| codec::encode(count).unwrap()),
        2 => 120..136_u8,
        1 => Just(b'h'),
        1 => Just(b'j'),
    ]
}

fn data() -> impl Strategy<Value = Vec<u8>> {
    prop::collection::vec(byte(), ENTRIES as usize)
}

/// Nodes by their places, and what they are filled with.
type Filled = Vec<(usize, Vec<u8>)>;

/// Distinct IDs, and for each buffer who is filled in which order with what.
fn cases() -> impl Strategy<Value = (Vec<u8>, Vec<Filled>)> {
    let ids: Vec<u8> = (121..=135).collect();
    prop::sample::subsequence(ids, 2..=15).prop_shuffle().prop_flat_map(|ids| {
        let nodes: Vec<usize> = (0..ids.len()).collect();
        let who = prop::sample::subsequence(nodes, 1..=ids.len().min(4)).prop_shuffle();
        let fill = |who: Vec<usize>| {
            let count = who.len();
            prop::collection::vec(data(), count)
                .prop_map(move |data| who.iter().copied().zip(data).collect::<Vec<_>>())
        };
        (Just(ids), prop::collection::vec(who.prop_flat_map(fill), 1..3))
    })
}

fn unit(machine: &Machine, at: usize) -> Unit {
    machine.bus.units().nth(at).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, ..ProptestConfig::default() })]

    #[test]
    fn a_job_is_refused_if_and_only_if_a_node_takes_data_for_a_command((ids, buffers) in cases()) {
        let axes = ids.len().min(9);
        let machine = machine(&ids[..axes], &ids[axes..]);
        let fill = |(first, (at, bytes)): (bool, (usize, Vec<u8>))| {
            Fill { unit: unit(&machine, at), master: first, bytes }
        };
        let buffers = buffers.into_iter().map(|fills| {
            let first = (0..).map(|at| at == 0);
            first.zip(fills).map(fill).collect()
        });
        let job = job(&machine, buffers.collect());
        let verdict = lint(&job, &machine);
        let taken = hazard(&machine, &job);
        // The parameters of a command in the last pair of the data are the start, which that node
        // then misses, and makes no step.
        let is_last = matches!(verdict, Err(JobError::Command { tick, .. }) if (tick + 2) % u64::from(ENTRIES) == 0);
        prop_assert!(verdict.is_err() == taken || is_last && !taken, "{:?}", verdict);
    }

    /// IDs from 129 on can occur in data. What the search gives is safe; where it gives nothing,
    /// no order of these nodes, resting ones filled or not, would be.
    #[test]
    fn the_order_of_filling_is_found_if_there_is_one(
        ids in prop::sample::subsequence(vec![122_u8, 129, 130, 131, 135], 4).prop_shuffle(),
        moving in prop::collection::vec(prop::collection::vec(-7..=7_i32, 4), 1..=3),
    ) {
        let mut machine = machine(&ids[..3], &ids[3..]);
        for profile in &mut machine.axes {
            // Any counts may follow each other.
            profile.accel_max_mm_s2 = 1e6;
        }
        let start_steps = machine.nearest_steps(&machine.work_zero_mm);
        let tick = |at: usize| {
            let mut counts = AxisMap::default();
            for (axis, data) in Axis::LINEAR.into_iter().zip(&moving) {
                counts[axis] = data[at];
            }
            Command::Tick(Tick { buffer: 0, line: 1, counts })
        };
        match Job::new((0..4).map(tick), start_steps, &machine) {
            Ok(job) => {
                prop_assert!(lint(&job, &machine).is_ok());
                prop_assert!(!hazard(&machine, &job));
            }
            Err(JobError::Command { of, .. }) => {
                prop_assert!(of.axis.is_some());
                let safe = orders(&machine, &moving).into_iter().find(|fills| {
                    lint(&job(&machine, vec![fills.clone()]), &machine).is_ok()
                });
                prop_assert_eq!(safe, None);
            }
            Err(other) => prop_assert!(false, "{}", other),
        }
    }
}

/// All orders of filling all nodes, the resting ones with zeros. To fill one that need not be full does
/// no harm: zeros are no command.
fn orders(machine: &Machine, moving: &[Vec<i32>]) -> Vec<Vec<Fill>> {
    let fill = |(at, unit): (usize, Unit)| {
        let mut bytes: Vec<u8> = moving.get(at).map_or(Vec::new(), |data| {
            data.iter().map(|count| codec::encode(*count).unwrap()).collect()
        });
        bytes.resize(ENTRIES as usize, 0);
        Fill { unit, master: at == 0, bytes }
    };
    let mut orders: Vec<Vec<Fill>> = vec![Vec::new()];
    for next in machine.bus.units().enumerate().map(fill) {
        let inserted = |order: &Vec<Fill>| {
            let at = |place| {
                let mut order = order.clone();
                order.insert(place, next.clone());
                order
            };
            (0..=order.len()).map(at).collect::<Vec<_>>()
        };
        orders = orders.iter().flat_map(inserted).collect();
    }
    orders
}

/// What a proof counts: a ping of each node at first, per buffer one before its fill, one before the
/// start, one after; and the pairs that only the order of filling makes harmless.
#[test]
fn a_proof_says_what_it_looked_at() {
    let machine = machine(&[122, 129], &[135]);
    let fill = |axis: Axis, master, bytes: [u8; 8]| {
        let id = machine.bus.nodes[&axis];
        Fill { unit: Unit { axis: Some(axis), id }, master, bytes: bytes.to_vec() }
    };
    let y = fill(Axis::Y, true, [1, 1, 0, 0, 0, 0, 0, 0]);
    let x = fill(Axis::X, false, [129, 0, 1, 129, 129, 129, 0, 0]);
    let proof = lint(&job(&machine, vec![vec![y.clone(), x.clone()]]), &machine).unwrap();
    assert_eq!((proof.buffers, proof.nodes, proof.avoided), (1, 3, 2));
    assert_eq!(proof.bytes, 8 * (3 + 3 * 2) + 2 * (2 + 8) + 2 + 8);
    assert_eq!(proof.pairs * 2, proof.bytes);
    let refused = lint(&job(&machine, vec![vec![x.clone(), y.clone()]]), &machine);
    let message = refused.unwrap_err().to_string();
    assert!(message.contains("tick 0: the data of node 122 of axis X"), "{message}");
    let masters = lint(&job(&machine, vec![vec![x.clone()]]), &machine);
    assert_eq!(masters, Err(JobError::Masters { buffer: 0, masters: 0 }));
    let twice = lint(&job(&machine, vec![vec![y.clone(), y]]), &machine);
    assert!(matches!(twice, Err(JobError::Masters { masters: 2, .. })));
    let stranger = Fill { unit: Unit { axis: None, id: 131 }, master: true, ..x };
    let stranger = lint(&job(&machine, vec![vec![stranger]]), &machine);
    assert!(matches!(stranger, Err(JobError::NotEmpty { .. })));
}

fn masters(choice: &str, peaks: &[[i32; 3]]) -> Vec<Option<Axis>> {
    let text = Machine::load("starmill")
        .unwrap()
        .to_toml()
        .replace("master = \"auto\"", &format!("metronome_id = 127\nmaster = \"{choice}\""));
    let machine = Machine::parse("changed", &text).unwrap();
    let commands = (0..).zip(peaks).flat_map(|(buffer, peak)| {
        (0..6).map(move |at| {
            let counts = BTreeMap::from([(Axis::X, 0), (Axis::Y, 1), (Axis::Z, 2)]);
            // The greater its peak, the more ticks an axis moves in.
            let count = |axis| i32::from(counts.get(&axis).is_some_and(|i| peak[*i] > at));
            Command::Tick(Tick { buffer, line: 1, counts: AxisMap::from_fn(count) })
        })
    });
    let start = machine.nearest_steps(&machine.work_zero_mm);
    let job = Job::new(commands, start, &machine).unwrap();
    lint(&job, &machine).unwrap();
    job.buffers()
        .map(|buffer| {
            let master = buffer.master().unwrap();
            let beats = master.bytes.iter().all(|byte| *byte == 100);
            assert_eq!(beats, master.unit == Unit { axis: None, id: 127 });
            master.unit.axis
        })
        .collect()
}

#[test]
fn the_master_is_who_the_profile_says() {
    let peaks = [[2, 3, 1], [0, 2, 2], [4, 1, 0], [1, 1, 1]];
    let (x, y, z) = (Some(Axis::X), Some(Axis::Y), Some(Axis::Z));
    assert_eq!(masters("auto", &peaks), [y, y, x, x]);
    assert_eq!(masters("rotate", &peaks), [x, y, x, z]);
    assert_eq!(masters("Z", &peaks), [z, z, z, z]);
    assert_eq!(masters("metronome", &peaks), [None; 4]);
}
