//! Arcs: from their words to a centre, and what can be wrong with them.
//!
//! ```text
//!          end                I J K: from the start to the centre; the end has to lie at the
//!        ,-'                  same distance.
//!      ,'     half chord      R: the centre lies on the perpendicular bisector of the chord;
//!     /    · centre           the arc is at most half a turn for R > 0, at least half for R < 0.
//!    start
//! ```

use crate::base::{Axis, Machine, Plane};
use crate::gcode::{Block, Fault, Word, rules};

/// Ends of an arc that are no further apart in the plane make a full circle (RS274/NGC).
pub const FULL_CIRCLE_MM: f64 = 1e-8;

/// Radii below this are none.
const RADIUS_MIN_MM: f64 = 1e-6;

/// Of a larger difference than this between the radii at both ends an arc is doubtful; what
/// rounding to three decimals makes stays below.
const DOUBTFUL_MM: f64 = 0.005;

/// Share of the radius by which the radii may differ whatever the tolerance.
const RADIUS_SHARE: f64 = 0.001;

/// A difference of this many tolerances is wrong, however large the radius.
const TOLERANCES_MAX: f64 = 100.0;

/// What 0.028 mm leaves of LinuxCNC's tolerance, which is 0.02 · √2 mm.
const ROUNDED_OFF: f64 = 1.0102;

/// In inches the tolerance is 2.54 times as large, as in LinuxCNC: there it is 0.002 · √2 inches,
/// for programs in inches have three decimals where others have two.
const TOLERANCE_OF_INCHES: f64 = 2.54;

/// How far the radii of an arc's ends may differ, in a program of these units.
pub(super) fn tolerance_mm(machine: &Machine, mm_per_unit: f64) -> f64 {
    let by_unit = if mm_per_unit > 1.0 { TOLERANCE_OF_INCHES } else { 1.0 };
    machine.arc_radius_tolerance_mm * ROUNDED_OFF * by_unit
}

/// An arc in its plane, in machine coordinates, and how its words are meant.
pub(super) struct ArcTask<'a> {
    pub block: &'a Block,
    pub plane: Plane,
    pub ccw: bool,
    /// Start and end on the plane's first and second axis.
    pub start_mm: [f64; 2],
    pub end_mm: [f64; 2],
    /// Program units.
    pub mm_per_unit: f64,
    /// What an end word of 0 stands for: program zero, or the start if words are distances.
    pub end_origin_mm: [f64; 2],
    /// What I J K are measured from: the start, or program zero (G90.1).
    pub center_origin_mm: [f64; 2],
    /// G90.1
    pub centers_absolute: bool,
    /// How far the radii at both ends may differ.
    pub tolerance_mm: f64,
    /// Motor steps a mm on the plane's first axis.
    pub steps_per_mm: f64,
}

/// The letter of the centre's distance along an axis.
pub(super) fn center_letter(axis: Axis) -> u8 {
    match axis {
        Axis::X => b'I',
        Axis::Y => b'J',
        _ => b'K',
    }
}

impl ArcTask<'_> {
    /// The centre, or what is wrong. A doubtful arc has both.
    pub fn center_mm(&self, faults: &mut Vec<Fault>) -> Option<[f64; 2]> {
        let letters = self.plane.axes().map(center_letter);
        let [first, second] = letters.map(|letter| self.block.word(letter));
        match (self.block.word(b'R'), first.or(second)) {
            (Some(radius), None) => self.by_radius(radius, faults),
            (None, Some(_)) => {
                if self.centers_absolute && (first.is_none() || second.is_none()) {
                    let [first, second] = letters.map(char::from);
                    let message = format!("under G90.1 an arc needs both {first} and {second}");
                    faults.push(Fault::block(&rules::ARC_CENTER, self.block, message));
                    return None;
                }
                let offset = [first, second].map(|word| word.map_or(0.0, |word| word.value));
                self.by_center(offset, faults)
            }
            (Some(radius), Some(_)) => {
                let message = "an arc has either a centre (I J K) or a radius (R)";
                faults.push(Fault::word(&rules::ARC_CENTER, radius, message).help("leave out R"));
                None
            }
            (None, None) => {
                let [first, second] = letters.map(char::from);
                let name = self.plane.name();
                let message = format!(
                    "this arc in the {name} plane has neither a centre ({first}, {second}) nor a radius (R)"
                );
                let fault = Fault::block(&rules::ARC_CENTER, self.block, message);
                faults.push(fault.help(format!(
                    "write {first} and {second}, the distances from the start to the centre"
                )));
                None
            }
        }
    }

    /// The centre of an arc by I J K, if there is no doubt about it.
    #[inline]
    pub fn sure_center_mm(&self) -> Option<[f64; 2]> {
        let words = self.plane.axes().map(|axis| self.block.word(center_letter(axis)));
        if self.centers_absolute && words.iter().any(Option::is_none) {
            return None;
        }
        let center = self.named_center(words.map(|word| word.map_or(0.0, |word| word.value)));
        let radii = [self.start_mm, self.end_mm].map(|end| distance(end, center));
        let is_sure = (radii[0] - radii[1]).abs() <= DOUBTFUL_MM.min(self.tolerance_mm)
            && radii[0].min(radii[1]) >= RADIUS_MIN_MM;
        is_sure.then_some(center)
    }

    /// Where words say that the centre is.
    #[inline]
    fn named_center(&self, offset: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|i| self.center_origin_mm[i] + offset[i] * self.mm_per_unit)
    }

    fn by_center(&self, offset: [f64; 2], faults: &mut Vec<Fault>) -> Option<[f64; 2]> {
        let center = self.named_center(offset);
        let start_radius = distance(self.start_mm, center);
        let end_radius = distance(self.end_mm, center);
        let greater = start_radius.max(end_radius);
        let difference = (start_radius - end_radius).abs();
        let beyond_share = difference > RADIUS_SHARE * greater;
        let is_wrong = difference > TOLERANCES_MAX * self.tolerance_mm
            || (difference > self.tolerance_mm && beyond_share);
        if !is_wrong && start_radius.min(end_radius) < RADIUS_MIN_MM {
            let message = "the radius of this arc is zero";
            faults.push(Fault::block(&rules::ARC_TOO_SMALL, self.block, message));
            return None;
        }
        if is_wrong || (difference > DOUBTFUL_MM && beyond_share) {
            let rule = if is_wrong { &rules::ARC_RADIUS } else { &rules::ARC_RADIUS_DOUBTFUL };
            let message = format!(
                "the radius is {start_radius:.4} mm at the start and {end_radius:.4} mm at the end: \
                 they differ by {difference:.4} mm ({:.1} steps)",
                difference * self.steps_per_mm
            );
            let fault = Fault::block(rule, self.block, message);
            let remedy = self.absolute_center(offset).or_else(|| self.remedy(center, start_radius));
            faults.push(match remedy {
                Some(remedy) => fault.help(remedy),
                None => fault,
            });
        }
        (!is_wrong).then_some(center)
    }

    fn by_radius(&self, word: &Word, faults: &mut Vec<Fault>) -> Option<[f64; 2]> {
        let chord = [0, 1].map(|i| self.end_mm[i] - self.start_mm[i]);
        let half = libm::hypot(chord[0], chord[1]) / 2.0;
        if 2.0 * half <= FULL_CIRCLE_MM {
            let message = "the arc ends where it starts: R leaves its centre open";
            let [first, second] = self.plane.axes().map(|axis| char::from(center_letter(axis)));
            let help = format!("write {first} and {second} for a full circle");
            faults.push(Fault::word(&rules::ARC_CLOSED, word, message).help(help));
            return None;
        }
        let radius = word.value.abs() * self.mm_per_unit;
        let lacking = half - radius;
        if lacking > self.tolerance_mm || radius < RADIUS_MIN_MM {
            let message = format!(
                "start and end are {:.4} mm apart, more than twice the radius of {radius:.4} mm",
                2.0 * half
            );
            let least = (half / self.mm_per_unit * 1e4).ceil() / 1e4;
            let help = format!("the radius has to be {least} at least");
            faults.push(Fault::word(&rules::ARC_TOO_SMALL, word, message).help(help));
            return None;
        }
        if lacking > DOUBTFUL_MM && lacking > RADIUS_SHARE * half {
            let message = format!(
                "the radius of {radius:.4} mm is {lacking:.4} mm ({:.1} steps) too small to reach \
                 from start to end: taken as half a circle",
                lacking * self.steps_per_mm
            );
            faults.push(Fault::word(&rules::ARC_RADIUS_DOUBTFUL, word, message));
        }
        // A radius too small by no more than rounding makes half a circle.
        let apart = ((radius - half) * (radius + half)).max(0.0).sqrt();
        let is_left = self.ccw == (word.value > 0.0);
        let share = if is_left { apart } else { -apart } / (2.0 * half);
        Some([
            self.start_mm[0] + chord[0] / 2.0 - chord[1] * share,
            self.start_mm[1] + chord[1] / 2.0 + chord[0] * share,
        ])
    }

    /// Whether the centre's words fit as positions, and what to write then.
    fn absolute_center(&self, offset: [f64; 2]) -> Option<String> {
        let center = [0, 1].map(|i| self.end_origin_mm[i] + offset[i] * self.mm_per_unit);
        let radii = [self.start_mm, self.end_mm].map(|end| distance(end, center));
        let fits = (radii[0] - radii[1]).abs() < self.tolerance_mm && radii[0] > self.tolerance_mm;
        if !fits || self.end_origin_mm == self.start_mm {
            return None;
        }
        let [first, second] = self.plane.axes().map(|axis| char::from(center_letter(axis)));
        Some(format!("as positions {first} and {second} fit: write G90.1 before"))
    }

    /// Which single word would make both radii equal: one of the end, one of the centre.
    fn remedy(&self, center: [f64; 2], radius: f64) -> Option<String> {
        let axes = self.plane.axes();
        // The end word i that lies on the circle, nearest to the one written.
        let end = [0, 1].into_iter().filter_map(|i| {
            let across = self.end_mm[1 - i] - center[1 - i];
            let along = ((radius - across) * (radius + across)).max(-1.0);
            let along = (along >= 0.0).then(|| along.sqrt())?;
            let at = center[i] + along.copysign(self.end_mm[i] - center[i]);
            Some((axes[i].letter(), at - self.end_origin_mm[i], (at - self.end_mm[i]).abs()))
        });
        // The centre word i that lies as far from the end as from the start.
        let chord = [0, 1].map(|i| self.end_mm[i] - self.start_mm[i]);
        let middle = [0, 1].into_iter().filter_map(|i| {
            if chord[i].abs() < RADIUS_MIN_MM {
                return None;
            }
            let other = center[1 - i] - self.start_mm[1 - i];
            let square = chord[0] * chord[0] + chord[1] * chord[1];
            let at = (square - 2.0 * chord[1 - i] * other) / (2.0 * chord[i]);
            let letter = char::from(center_letter(axes[i]));
            let word_mm = self.start_mm[i] + at - self.center_origin_mm[i];
            Some((letter, word_mm, (self.start_mm[i] + at - center[i]).abs()))
        });
        let nearest = |words: &mut dyn Iterator<Item = (char, f64, f64)>| {
            let (letter, value_mm, _) = words.min_by(|a, b| a.2.total_cmp(&b.2))?;
            // Four decimals: finer than a step in either unit.
            let value = (value_mm / self.mm_per_unit * 1e4).round() / 1e4;
            Some(format!("{letter}{}", value + 0.0))
        };
        match (nearest(&mut { end }), nearest(&mut { middle })) {
            (Some(end), Some(center)) => Some(format!(
                "{end} would put the end on the circle, {center} the centre between both ends"
            )),
            (Some(end), None) => Some(format!("{end} would put the end on the circle")),
            (None, Some(center)) => {
                Some(format!("{center} would put the centre between both ends"))
            }
            (None, None) => None,
        }
    }
}

/// Positions are far from where a square would overflow, and this takes a third of the time of
/// `hypot`.
pub(super) fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    let [x, y] = [a[0] - b[0], a[1] - b[1]];
    (x * x + y * y).sqrt()
}

/// Angle that an arc turns by, all turns included; never negative.
pub(super) fn sweep_rad(
    start: [f64; 2],
    end: [f64; 2],
    center: [f64; 2],
    ccw: bool,
    turns: u32,
) -> f64 {
    use std::f64::consts::TAU;
    let (from, to) = if ccw { (start, end) } else { (end, start) };
    let is_full = distance(start, end) <= FULL_CIRCLE_MM;
    let part = (angle(to, center) - angle(from, center)).rem_euclid(TAU);
    (if is_full { TAU } else { part }) + TAU * f64::from(turns)
}

fn angle(point: [f64; 2], center: [f64; 2]) -> f64 {
    libm::atan2(point[1] - center[1], point[0] - center[0])
}

/// Least and greatest position of an arc on the plane's first and second axis: its ends, and
/// where it crosses the directions of the axes. A radius that changes from start to end is taken
/// linearly over the angle.
pub(super) fn bounds_mm(
    start: [f64; 2],
    end: [f64; 2],
    center: [f64; 2],
    ccw: bool,
    turns: u32,
) -> [[f64; 2]; 2] {
    use std::f64::consts::FRAC_PI_2;
    let mut bounds = [0, 1].map(|i| [start[i].min(end[i]), start[i].max(end[i])]);
    let radii = [distance(start, center), distance(end, center)];
    // From here on counter-clockwise: an arc read from its end is one the other way round.
    let from = if ccw { start } else { end };
    let radii = if ccw { radii } else { [radii[1], radii[0]] };
    let from_angle = angle(from, center);
    let sweep = sweep_rad(start, end, center, ccw, turns);
    let first = (from_angle / FRAC_PI_2).ceil() as i64;
    // Four directions a turn; more turns meet the same ones.
    for quarter in first..first + 4 {
        let share = (quarter as f64 * FRAC_PI_2 - from_angle) / sweep;
        if share > 1.0 {
            break;
        }
        let radius = radii[0] + (radii[1] - radii[0]) * share;
        let (axis, sign) = match quarter.rem_euclid(4) {
            0 => (0, 1.0),
            1 => (1, 1.0),
            2 => (0, -1.0),
            _ => (1, -1.0),
        };
        let reach = center[axis] + sign * radius;
        bounds[axis] = [bounds[axis][0].min(reach), bounds[axis][1].max(reach)];
    }
    bounds
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::gcode::parse;

    fn center_of(words: &str, end_mm: [f64; 2], ccw: bool) -> Result<[f64; 2], &'static str> {
        let (mut block, mut faults) = (Block::default(), Vec::new());
        parse(words.as_bytes(), &mut block, &mut faults);
        let task = ArcTask {
            block: &block,
            plane: Plane::Xy,
            ccw,
            start_mm: [0.0, 0.0],
            end_mm,
            mm_per_unit: 1.0,
            end_origin_mm: [0.0, 0.0],
            center_origin_mm: [0.0, 0.0],
            centers_absolute: false,
            tolerance_mm: 0.028,
            steps_per_mm: 100.0,
        };
        let center = task.center_mm(&mut faults);
        match faults.first() {
            Some(fault) => Err(fault.rule.name),
            None => Ok(center.unwrap()),
        }
    }

    #[test]
    fn radii_may_differ_by_the_tolerance() {
        for (words, end_x, expected) in [
            ("I10", 20.0, None),
            ("I10", 20.004, None),
            ("I10", 20.02, Some("arc-radius-doubtful")),
            ("I10", 20.03, Some("arc-radius")),
            // Of a large radius a tenth of a percent may be missing, up to 100 tolerances.
            ("I1000", 2000.9, None),
            ("I1000", 2001.1, Some("arc-radius")),
            ("I10000", 20002.7, None),
            ("I10000", 20002.9, Some("arc-radius")),
            ("I0 J0", 0.01, Some("arc-too-small")),
            ("I0.01", 0.01, Some("arc-too-small")),
            ("R10", 20.004, None),
            ("R10", 20.05, Some("arc-radius-doubtful")),
            ("R10", 20.06, Some("arc-too-small")),
            ("R0", 0.01, Some("arc-too-small")),
            ("R5", 1e-9, Some("arc-closed")),
            ("R5 I5", 10.0, Some("arc-center")),
            ("F5", 10.0, Some("arc-center")),
        ] {
            let found = center_of(words, [end_x, 0.0], true).err();
            assert_eq!(found, expected, "{words} X{end_x}");
        }
    }

    proptest! {
        #[test]
        fn a_radius_gives_the_centre_on_the_side_it_says(
            x in -100.0..100.0_f64, y in -100.0..100.0_f64, more in 0.01..50.0_f64,
            ccw: bool, long: bool,
        ) {
            let radius = libm::hypot(x, y) / 2.0 + more;
            let words = format!("R{}", if long { -radius } else { radius });
            let center = center_of(&words, [x, y], ccw).unwrap();
            prop_assert!((distance([0.0, 0.0], center) - radius).abs() < 1e-9 * radius);
            prop_assert!((distance([x, y], center) - radius).abs() < 1e-9 * radius);
            // The short way lies counter-clockwise of the start where this is positive.
            let cross = -center[0] * (y - center[1]) + center[1] * (x - center[0]);
            prop_assert_eq!(cross > 0.0, ccw != long);
        }
    }

    fn check(start: [f64; 2], end: [f64; 2], ccw: bool, expected: [[f64; 2]; 2]) {
        let found = bounds_mm(start, end, [0.0, 0.0], ccw, 0);
        for (found, expected) in found.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((found - expected).abs() < 1e-12, "{start:?} {end:?} {ccw}: {found}");
        }
    }

    #[test]
    fn arcs_reach_as_far_as_the_axes_they_cross() {
        let h = std::f64::consts::FRAC_1_SQRT_2;
        check([1.0, 0.0], [1.0, 0.0], true, [[-1.0, 1.0], [-1.0, 1.0]]);
        check([1.0, 0.0], [0.0, 1.0], true, [[0.0, 1.0], [0.0, 1.0]]);
        check([1.0, 0.0], [0.0, 1.0], false, [[-1.0, 1.0], [-1.0, 1.0]]);
        check([h, h], [-h, h], true, [[-h, h], [h, 1.0]]);
        check([h, h], [-h, h], false, [[-1.0, 1.0], [-1.0, h]]);
        check([-h, h], [-h, -h], true, [[-1.0, -h], [-h, h]]);
    }
}
