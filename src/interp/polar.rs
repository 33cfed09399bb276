//! Polar coordinates: `@radius ^angle` (LinuxCNC) and G16, both about the program's origin.
//!
//! `@` and `^` stand for X and Y, in G17; what is missing of them is that of where the
//! machine stands, and under G91 both are distances. G16 makes radius and angle of the words of the
//! plane's two axes. Under G91 its angle goes on from the one before; a radius there is a way from
//! where the machine stands (FANUC), an angle alone a turn about the origin.

use crate::base::{Axis, Plane, Point};
use crate::gcode::codes::POLAR_LETTERS;
use crate::gcode::{Block, Fault, Word, letter_set, rules};

use super::execute::{Asked, Executor};
use super::frames::sin_cos_deg;

/// By how much a place moves from one hole of a cycle to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PolarStep {
    axes: [Axis; 2],
    radius_mm: f64,
    angle_deg: f64,
    /// From place to place, in this direction; else about the origin.
    walks_deg: Option<f64>,
}

impl PolarStep {
    /// Moves a place once more.
    pub fn apply(&mut self, at: &mut Point) {
        let from = self.axes.map(|axis| at[axis]);
        let to = match &mut self.walks_deg {
            Some(direction_deg) => {
                *direction_deg += self.angle_deg;
                let by = from_polar(self.radius_mm, *direction_deg);
                [from[0] + by[0], from[1] + by[1]]
            }
            None => {
                let (radius, angle) = polar(from);
                from_polar(radius + self.radius_mm, angle + self.angle_deg)
            }
        };
        [at[self.axes[0]], at[self.axes[1]]] = to;
    }
}

/// What G16 keeps from block to block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PolarMode {
    /// The angle given last.
    angle_deg: f64,
    /// Whether the radius given last was a way from where the machine stood.
    walked: bool,
}

impl Executor<'_> {
    /// A block with `@` and `^` as one with X and Y; and the step of a cycle that repeats under G91.
    pub(super) fn resolve_polar(
        &self,
        block: &Block,
        asked: &mut Asked,
        faults: &mut Vec<Fault>,
    ) -> Option<Block> {
        let words = [b'@', b'^'].map(|letter| block.word(letter));
        let first = *words[0].or(words[1])?;
        if let Some(word) = block.first_of(letter_set("XY")) {
            let message = format!("{word} stands beside the polar coordinates {first}");
            let fault = Fault::word(&rules::AXIS_WORDS_TWICE, word, message);
            faults.push(fault.help("leave out X and Y, or @ and ^"));
            return None;
        }
        if asked.machine_coordinates || asked.axes_claimed || self.polar || self.diameters {
            let message =
                format!("{first}: polar coordinates go with motion in work coordinates only");
            let fault = Fault::word(&rules::AXIS_WORDS_TWICE, &first, message);
            faults.push(
                fault.help("write X and Y beside G53, G92, G10 and the like, under G16 and G7"),
            );
            return None;
        }
        if self.plane != Plane::Xy {
            let message =
                format!("{first} stands where the {} plane is in force", self.plane.name());
            let fault = Fault::word(&rules::UNSUPPORTED_WORD, &first, message);
            faults.push(fault.help("polar coordinates are of X and Y: write G17 before"));
            return None;
        }
        let from = [Axis::X, Axis::Y].map(|axis| self.position_in_program(axis));
        let (radius, angle) = polar(from);
        let [by_radius, by_angle] = words.map(|word| word.map(|word| word.value));
        let is_at_origin = radius <= 1e-9;
        if is_at_origin && (!self.absolute || by_angle.is_none()) {
            let message = format!("{first}: from the origin no angle can be told");
            let fault = Fault::word(&rules::MISSING_WORD, &first, message);
            faults.push(fault.help("write radius and angle, as @5 ^30, under G90"));
            return None;
        }
        let to = if self.absolute {
            from_polar(by_radius.unwrap_or(radius), by_angle.unwrap_or(angle))
        } else {
            let by = (by_radius.unwrap_or_default(), by_angle.unwrap_or_default());
            let radius_mm = by.0 * self.mm_per_unit;
            let axes = [Axis::X, Axis::Y];
            asked.polar_step =
                Some(PolarStep { axes, radius_mm, angle_deg: by.1, walks_deg: None });
            let to = from_polar(radius + by.0, angle + by.1);
            [to[0] - from[0], to[1] - from[1]]
        };
        let spans = words.map(|word| word.copied().unwrap_or(first));
        let word = |letter, at: usize| Word { letter, value: to[at], ..spans[at] };
        let mut resolved = Block::default();
        resolved.copy_words(block);
        resolved.replace(POLAR_LETTERS, [word(b'X', 0), word(b'Y', 1)]);
        Some(resolved)
    }

    /// Where the words of the plane's axes lead under G16, on these axes in mm: `to` holds what
    /// they say, or where the machine stands.
    pub(super) fn polar_target(
        &mut self,
        words: [Option<&Word>; 2],
        from: [f64; 2],
        to: [f64; 2],
        faults: &mut Vec<Fault>,
    ) -> Option<[f64; 2]> {
        let (radius, angle_deg) = polar(from);
        let told_deg = words[1].map(|word| word.value);
        if self.absolute {
            let angle_deg = told_deg.unwrap_or(angle_deg);
            self.polar_mode = PolarMode { angle_deg, walked: false };
            return Some(from_polar(if words[0].is_some() { to[0] } else { radius }, angle_deg));
        }
        let by_deg = told_deg.unwrap_or_default();
        if words[0].is_some() {
            let angle_deg = self.polar_mode.angle_deg + by_deg;
            self.polar_mode = PolarMode { angle_deg, walked: true };
            let by = from_polar(to[0] - from[0], angle_deg);
            return Some([from[0] + by[0], from[1] + by[1]]);
        }
        if let Some(word) = words[1].filter(|_| self.polar_mode.walked) {
            let message = format!("{word}: behind a radius under G91 it may turn about two places");
            let fault = Fault::word(&rules::UNSUPPORTED_WORD, word, message);
            faults.push(fault.help("write the radius too, or both under G90"));
            return None;
        }
        self.polar_mode.angle_deg = angle_deg + by_deg;
        Some(from_polar(radius, angle_deg + by_deg))
    }

    /// The step of a cycle that repeats under G16 and G91.
    pub(super) fn polar_mode_step(&self, block: &Block) -> Option<PolarStep> {
        if self.absolute {
            return None;
        }
        let axes = self.plane.axes();
        let words = axes.map(|axis| block.word(axis.letter() as u8));
        let angle_deg = words[1].map_or(0.0, |word| word.value);
        match words {
            [None, None] => None,
            [None, Some(_)] => Some(PolarStep { axes, radius_mm: 0.0, angle_deg, walks_deg: None }),
            [Some(radius), _] => {
                let radius_mm = radius.value * self.mm_per_unit;
                let walks_deg = Some(self.polar_mode.angle_deg + angle_deg);
                Some(PolarStep { axes, radius_mm, angle_deg, walks_deg })
            }
        }
    }
}

/// Radius and angle of a place.
fn polar([first, second]: [f64; 2]) -> (f64, f64) {
    (libm::hypot(first, second), libm::atan2(second, first).to_degrees())
}

fn from_polar(radius: f64, angle_deg: f64) -> [f64; 2] {
    let (sin, cos) = sin_cos_deg(angle_deg);
    [radius * cos, radius * sin]
}
