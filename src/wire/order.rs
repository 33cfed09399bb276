//! The order in which nodes are filled, so that no node takes another's data for its fill command
//! (H1, H5).
//!
//! Only IDs 129 to 135 can appear in data, as counts of -1 to -7. A full node ignores its ID, so a
//! node whose ID appears at an even offset of another's data has to be full before that is sent.

use std::collections::BTreeMap;

use crate::base::Axis;
use crate::wire::job::Fill;

/// Data that no order of filling makes harmless.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clash {
    /// Whose data.
    pub axis: Axis,
    /// Entry of the buffer.
    pub tick: usize,
    /// The node that would take it for its fill command.
    pub other: Axis,
    /// That node's ID.
    pub id: u8,
}

/// Puts fills in order, nodes without a need of theirs in the order given. Nodes that rest and
/// are needed full are added, with zeros.
pub(super) fn fill_order(
    mut fills: Vec<Fill>,
    nodes: &BTreeMap<Axis, u8>,
) -> Result<Vec<Fill>, Clash> {
    let mut needs = Vec::new();
    let mut at = 0;
    while let Some(fill) = fills.get(at) {
        let entries = fill.bytes.len();
        let of_fill = needs_of(fill, nodes);
        for need in &of_fill {
            if !fills.iter().any(|fill| fill.id == need.id) {
                let (axis, id) = (need.other, need.id);
                fills.push(Fill { axis, id, master: false, bytes: vec![0; entries] });
            }
        }
        needs.extend(of_fill);
        at += 1;
    }
    let mut ordered: Vec<Fill> = Vec::with_capacity(fills.len());
    while !fills.is_empty() {
        let waits = |fill: &Fill| {
            let full = |id| ordered.iter().any(|fill: &Fill| fill.id == id);
            needs.iter().find(|need| need.axis == fill.axis && !full(need.id)).copied()
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
fn needs_of(fill: &Fill, nodes: &BTreeMap<Axis, u8>) -> Vec<Clash> {
    let others = nodes.iter().filter(|(_, id)| **id != fill.id);
    let first = |(other, id): (&Axis, &u8)| {
        let tick = fill.bytes.iter().step_by(2).position(|byte| byte == id)? * 2;
        Some(Clash { axis: fill.axis, tick, other: *other, id: *id })
    };
    others.filter_map(first).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fill(axis: Axis, id: u8, bytes: &[u8]) -> Fill {
        Fill { axis, id, master: false, bytes: bytes.to_vec() }
    }

    fn check(fills: Vec<Fill>, expected: Result<&[Axis], (Axis, usize)>) {
        let nodes = BTreeMap::from([(Axis::X, 129), (Axis::Y, 130), (Axis::Z, 123)]);
        let order = fill_order(fills, &nodes);
        let order = order.map(|fills| fills.iter().map(|fill| fill.axis).collect::<Vec<_>>());
        let expected = expected.map(<[Axis]>::to_vec);
        assert_eq!(order.map_err(|clash| (clash.axis, clash.tick)), expected);
    }

    #[test]
    fn a_node_whose_id_is_data_is_filled_before() {
        let x = |bytes: &[u8]| fill(Axis::X, 129, bytes);
        let y = |bytes: &[u8]| fill(Axis::Y, 130, bytes);
        let z = |bytes: &[u8]| fill(Axis::Z, 123, bytes);
        check(vec![x(&[1, 0, 1, 0]), z(&[2, 0, 2, 0])], Ok(&[Axis::X, Axis::Z]));
        check(vec![x(&[130, 0, 1, 0]), y(&[1, 0, 0, 0])], Ok(&[Axis::Y, Axis::X]));
        // At an odd offset it is the second byte of a pair, and its own ID no node minds.
        check(vec![x(&[129, 130, 1, 0]), y(&[1, 0, 0, 0])], Ok(&[Axis::X, Axis::Y]));
        // Y rests and gets zeros first.
        check(vec![z(&[1, 0, 130, 0])], Ok(&[Axis::Y, Axis::Z]));
        check(vec![x(&[0, 0, 130, 0]), y(&[129, 0, 0, 0])], Err((Axis::X, 2)));
    }
}
