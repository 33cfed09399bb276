//! Places in groups of neighbours, with the least that a buffer from any of them can cost: so that
//! the cheapest is found without a look at each.

use std::collections::VecDeque;

use crate::base::AxisSet;

use super::places::Place;

/// Places of a group.
pub const GROUP: usize = 16;

/// The groups of the places that are open. A group's number is that of its first place, divided by
/// [`GROUP`].
#[derive(Debug, Default)]
pub struct Groups {
    /// Number of the first group.
    first: usize,
    groups: VecDeque<Group>,
}

#[derive(Debug)]
struct Group {
    /// The least cost of its places, as [`super::cost::Cost::start_s`] has it. Costs only grow.
    least_s: f64,
    /// Axes that move on the ways to its places.
    moving: AxisSet,
}

impl Groups {
    /// Takes the next place.
    pub fn add(&mut self, number: usize, place: &Place, start_s: f64) {
        if number / GROUP == self.first + self.groups.len() {
            self.groups.push_back(Group { least_s: f64::INFINITY, moving: AxisSet::EMPTY });
        }
        if let Some(group) = self.groups.back_mut() {
            group.least_s = group.least_s.min(start_s);
            group.moving = group.moving.union(place.moving);
        }
    }

    /// The least cost of a group's places.
    pub fn least_s(&self, group: usize) -> f64 {
        self.groups[group - self.first].least_s
    }

    /// Axes that move on the ways to a group's places.
    pub fn moving(&self, group: usize) -> AxisSet {
        self.groups[group - self.first].moving
    }

    /// Forgets the groups before that of a place.
    pub fn forget_before(&mut self, place: usize) {
        self.groups.drain(..place / GROUP - self.first);
        self.first = place / GROUP;
    }
}
