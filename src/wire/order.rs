//! The order in which nodes are filled, so that no node takes another's data for its fill command
//! (H1, H5).
//!
//! Only IDs 129 to 135 can appear in data, as counts of -1 to -7. A full node ignores its ID, so a
//! node whose ID appears at an even offset of another's data has to be full before that is sent.

use crate::base::machine::Unit;
use crate::wire::job::Fill;

/// Data that no order of filling makes harmless.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clash {
    /// Whose data.
    pub of: Unit,
    /// Entry of the buffer.
    pub tick: usize,
    /// The node that would take it for its fill command.
    pub to: Unit,
}

/// Puts fills in order, nodes without a need of theirs in the order given. Nodes that rest and
/// are needed full are added, with zeros.
pub(super) fn fill_order(mut fills: Vec<Fill>, units: &[Unit]) -> Result<Vec<Fill>, Clash> {
    let mut needs = Vec::new();
    let mut at = 0;
    while let Some(fill) = fills.get(at) {
        let entries = fill.bytes.len();
        let of_fill = needs_of(fill, units);
        for need in &of_fill {
            if !fills.iter().any(|fill| fill.unit == need.to) {
                fills.push(Fill { unit: need.to, master: false, bytes: vec![0; entries] });
            }
        }
        needs.extend(of_fill);
        at += 1;
    }
    let mut ordered: Vec<Fill> = Vec::with_capacity(fills.len());
    while !fills.is_empty() {
        let waits = |fill: &Fill| {
            let full = |unit| ordered.iter().any(|fill: &Fill| fill.unit == unit);
            needs.iter().find(|need| need.of == fill.unit && !full(need.to)).copied()
        };
        let waiting: Vec<Option<Clash>> = fills.iter().map(waits).collect();
        match waiting.iter().position(Option::is_none) {
            Some(at) => ordered.push(fills.remove(at)),
            // All wait for one another: any of them tells where.
            None => return waiting.into_iter().flatten().next().map_or(Ok(ordered), Err),
        }
    }
    Ok(ordered)
}

/// Nodes that must be full before this data is sent, each with the first tick that asks for it.
fn needs_of(fill: &Fill, units: &[Unit]) -> Vec<Clash> {
    let others = units.iter().filter(|unit| **unit != fill.unit);
    let first = |to: &Unit| {
        let tick = fill.bytes.iter().step_by(2).position(|byte| *byte == to.id)? * 2;
        Some(Clash { of: fill.unit, tick, to: *to })
    };
    others.filter_map(first).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Axis;

    const X: Unit = Unit { axis: Some(Axis::X), id: 129 };
    const Y: Unit = Unit { axis: Some(Axis::Y), id: 130 };
    const SPARE: Unit = Unit { axis: None, id: 123 };

    fn fill(unit: Unit, bytes: &[u8]) -> Fill {
        Fill { unit, master: false, bytes: bytes.to_vec() }
    }

    fn check(fills: Vec<Fill>, expected: Result<&[Unit], (Unit, usize)>) {
        let order = fill_order(fills, &[X, Y, SPARE]);
        let order = order.map(|fills| fills.iter().map(|fill| fill.unit).collect::<Vec<_>>());
        let expected = expected.map(<[Unit]>::to_vec);
        assert_eq!(order.map_err(|clash| (clash.of, clash.tick)), expected);
    }

    #[test]
    fn a_node_whose_id_is_data_is_filled_before() {
        let x = |bytes: &[u8]| fill(X, bytes);
        let y = |bytes: &[u8]| fill(Y, bytes);
        let spare = |bytes: &[u8]| fill(SPARE, bytes);
        check(vec![x(&[1, 0, 1, 0]), spare(&[2, 0, 2, 0])], Ok(&[X, SPARE]));
        check(vec![x(&[130, 0, 1, 0]), y(&[1, 0, 0, 0])], Ok(&[Y, X]));
        // At an odd offset it is the second byte of a pair, and its own ID no node minds.
        check(vec![x(&[129, 130, 1, 0]), y(&[1, 0, 0, 0])], Ok(&[X, Y]));
        // Y rests and gets zeros first.
        check(vec![spare(&[1, 0, 130, 0])], Ok(&[Y, SPARE]));
        check(vec![x(&[0, 0, 130, 0]), y(&[129, 0, 0, 0])], Err((X, 2)));
    }
}
