//! The ring of drives: time slots by the formulas of seed 000, positions that go round, telegrams that
//! are lost, and programs from `cnc bus --ring`.

use std::path::Path;

use assert_cmd::Command;
use cnc::base::{Axis, AxisMap, Command as Order, Tick};
use cnc::systems::sercos::{Carried, Fault, Place, Ring, Strike, slots};
use proptest::prelude::*;
use serde_json::Value;

/// Executes ticks on a ring, and gives what its drives did.
fn executed(ticks: &[[i32; 3]], strikes: &[Strike]) -> (Vec<[i32; 3]>, Option<Fault>) {
    let orders = ticks.iter().map(|[x, y, z]| {
        let mut counts = AxisMap::default();
        [counts[Axis::X], counts[Axis::Y], counts[Axis::Z]] = [*x, *y, *z];
        Ok::<_, ()>(Order::Tick(Tick { buffer: 0, line: 1, counts }))
    });
    let mut carried = Carried::new(orders, &Axis::LINEAR, &AxisMap::default(), strikes);
    let done = carried.by_ref().map(|order| match order {
        Ok(Order::Tick(tick)) => Axis::LINEAR.map(|axis| tick.counts[axis]),
        other => panic!("{other:?}"),
    });
    (done.collect(), carried.fault())
}

/// `cnc bus FILE --ring`: its exit code and its JSON.
fn ring(args: &str) -> (i32, Value) {
    let mut command = Command::cargo_bin("cnc").unwrap();
    command.current_dir(env!("CARGO_MANIFEST_DIR")).env_remove("CNC_MACHINE");
    command.args(["bus", "--ring", "--json", "-q"]).args(args.split_whitespace());
    let output = command.output().unwrap();
    let found = serde_json::from_slice(&output.stdout);
    let found = found.unwrap_or_else(|_| panic!("{args}: {output:?}"));
    (output.status.code().unwrap(), found)
}

#[test]
fn slots_are_as_long_as_the_formulas_say() {
    let baud = 2e6;
    for drives in [1, 2, 3, 4, 8, 254] {
        let slots = slots(drives, baud as u32);
        assert_eq!(slots.len(), drives as usize + 2);
        let mut at_s = 0.0;
        for slot in &slots {
            // Seed 000, section 3.3: the three times of transmission.
            let formula_s = match slot.place {
                Place::Sync => (2.0 * 8.0 + 4.0 * 9.6) / baud,
                Place::Drive(_) => (2.0 * 8.0 + 11.0 * 9.6) / baud,
                Place::Control => (2.0 * 8.0 + 3.0 * 9.6 + 8.0 * f64::from(drives) * 9.6) / baud,
            };
            assert!((slot.from_s - at_s).abs() < 1e-12, "{slot:?}");
            assert!((slot.to_s - slot.from_s - formula_s).abs() < 1e-12, "{slot:?}");
            at_s = slot.to_s;
        }
    }
}

#[test]
fn a_lost_telegram_repeats_a_step_and_two_in_a_row_stop_the_drive() {
    let ticks = [[5, -1, 0], [6, -2, 0], [8, -4, 0], [7, -3, 1], [6, -2, 2], [3, 0, 1]];
    let run = |faults: &str| {
        let strikes: Vec<Strike> = faults.split_whitespace().map(|f| f.parse().unwrap()).collect();
        executed(&ticks, &strikes)
    };
    let planned = ticks.to_vec();
    assert_eq!(run(""), (planned.clone(), None));
    // A telegram of a drive is heard by the control only, and one of them is not missed.
    assert_eq!(run("drive1@2 drive2@2 drive1@4.50"), (planned.clone(), None));
    let mut repeated = planned.clone();
    repeated[2] = planned[1];
    repeated[3] = [7 + 2, -3 - 2, 1];
    // The position of cycle 2 is taken in cycle 3.
    for faults in
        ["control@2", "sync@3", "control@2 sync@3", "control@2.0", "control@2.15 control@2.40"]
    {
        assert_eq!(run(faults), (repeated.clone(), None), "{faults}");
    }
    for (faults, cycle) in
        [("control@2 control@3", 4), ("control@2 sync@4", 4), ("sync@3 sync@4", 4)]
    {
        let (done, fault) = run(faults);
        assert_eq!(fault, Some(Fault::Stopped { axis: Axis::X, cycle, line: 1 }), "{faults}");
        // A step repeated, then none.
        assert_eq!(done, [planned[0], planned[1], planned[1], [0; 3]], "{faults}");
    }
    let unheard = Some(Fault::Unheard { axis: Axis::Y, cycle: 3, line: 1 });
    assert_eq!(run("drive2@2 drive2@3").1, unheard);
    // The last position, lost: the drive goes on by its last step, and comes back.
    let (done, fault) = run("control@5");
    assert_eq!((done.len(), fault), (7, None));
    assert_eq!(done[5..], [planned[4], [3 - 6, 2, 1 - 2]]);
}

#[test]
fn a_job_beyond_32_bits_is_refused() {
    let (done, fault) = executed(&[[i32::MAX, 0, 0], [1, 0, 0]], &[]);
    assert_eq!(fault, Some(Fault::Beyond { axis: Axis::X, line: 1 }));
    assert!(done.len() < 2, "{done:?}");
}

proptest! {
    /// Whatever goes round comes out the same, and no cycle is longer than its slots.
    #[test]
    fn positions_go_round(
        ticks in prop::collection::vec(prop::array::uniform3(-100_000..100_000), 1..40),
    ) {
        let mut expected = ticks.clone();
        let (mut done, fault) = executed(&ticks, &[]);
        prop_assert_eq!(fault, None);
        // A rest after the last step is not told.
        while expected.last() == Some(&[0; 3]) { expected.pop(); }
        while done.last() == Some(&[0; 3]) { done.pop(); }
        prop_assert_eq!(done, expected);
    }

    /// A bit flipped anywhere in one telegram stops nobody, and in the end each drive is where it
    /// was told to be; off its way it is by no more than its steps differ.
    #[test]
    fn one_flipped_bit_is_made_good(
        ticks in prop::collection::vec(prop::array::uniform3(-1000..1000), 3..20),
        cycle in 0_u64..20, place in 0_u8..5, bit in 0_usize..400,
    ) {
        let place = match place {
            0 => Place::Sync,
            4 => Place::Control,
            address => Place::Drive(address),
        };
        let (done, fault) = executed(&ticks, &[Strike { cycle, place, bit }]);
        prop_assert_eq!(fault, None);
        let sum = |ticks: &[[i32; 3]]| {
            ticks.iter().fold([0; 3], |sum, tick| std::array::from_fn(|i| sum[i] + tick[i]))
        };
        prop_assert_eq!(sum(&done), sum(&ticks));
        let most = |axis: usize| {
            let steps = [0].into_iter().chain(ticks.iter().map(move |tick| tick[axis]));
            let next = ticks.iter().map(move |tick| tick[axis]).chain([0]);
            steps.zip(next).map(|(a, b)| i32::abs_diff(a, b)).max().unwrap_or(0)
        };
        for at in 1..done.len().min(ticks.len()) {
            let (is, should) = (sum(&done[..at]), sum(&ticks[..at]));
            for axis in 0..3 {
                prop_assert!(i32::abs_diff(is[axis], should[axis]) <= most(axis));
            }
        }
    }

    /// No positions make a cycle longer than 9.6 bits a byte.
    #[test]
    fn a_cycle_keeps_to_its_slots(positions in prop::collection::vec(any::<i32>(), 1..20)) {
        let mut ring = Ring::new(&positions, &[]);
        ring.cycle(&positions);
        ring.cycle(&positions);
        let slots = slots(positions.len() as u32, 1);
        prop_assert!(ring.traffic().bits_max as f64 <= slots.last().unwrap().to_s);
        let actual: Vec<_> = ring.actual().collect();
        prop_assert_eq!(actual, positions.into_iter().map(Some).collect::<Vec<_>>());
    }
}

/// Executed is planned, and within the bound of the program's path.
fn check_samples(samples: &[&str]) {
    for sample in samples {
        let file = format!("samples/good/{sample}.nc");
        assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join(&file).exists());
        let (code, found) = ring(&format!("{file} --frequency 100"));
        assert_eq!(code, 0, "{sample}: {found}");
        assert_eq!(found["executed_as_planned"], true, "{sample}");
        assert_eq!(found["deviation_um"], 0.0, "{sample}");
        assert_eq!(found["verify"]["verdict"], "pass", "{sample}");
        let bits = &found["bits_a_cycle"];
        let of = |key: &str| bits[key].as_f64().unwrap();
        assert!(of("unstuffed") <= of("mean") && of("mean") <= of("max"), "{sample}: {bits}");
        assert!(of("max") <= of("estimate"), "{sample}: {bits}");
    }
}

#[test]
fn lines_and_arcs_go_round() {
    check_samples(&["blends", "kimm-test", "incremental", "inches", "loops", "two-tools"]);
}

#[test]
fn planes_and_splines_go_round() {
    check_samples(&["planes", "splines", "radius-arcs", "subroutine", "modal-state"]);
}

#[test]
fn a_ring_runs_at_the_cycle_that_seed_000_sets() {
    let (code, found) = ring("samples/good/macro-b.nc");
    assert_eq!((code, &found["cycle_us"]), (0, &500.into()));
    assert_eq!(found["bits_a_cycle"]["unstuffed"], 592.0);
    assert_eq!(found["bits_a_cycle"]["estimate"], 694.4);
    for (args, code, key, expected) in [
        ("--frequency 100 --fault control@20", 0, "dropped", "1"),
        ("--frequency 100 --fault control@20", 0, "repeated", "3"),
        ("--frequency 100 --fault control@20 --fault sync@22", 3, "executed_as_planned", "false"),
    ] {
        let (found_code, found) = ring(&format!("samples/good/macro-b.nc {args}"));
        assert_eq!((found_code, found[key].to_string()), (code, expected.to_owned()), "{args}");
    }
}
