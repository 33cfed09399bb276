//! Frames: from program coordinates to the machine's, and back.
//!
//! ```text
//! program ─scale (G51)▶─turn (G68)▶─mirror (G51.1)▶─shift (G92, G52)▶
//!         ─turn (G10 L2 R)▶─origin (G54…)▶─tool (G43)▶ machine
//! ```
//!
//! The machine position is what counts; a change of frame never moves the machine, it changes what
//! its position is called. All lengths are mm here, angles degrees.

use crate::base::{Axis, AxisMap, Machine, Plane, Point};

/// How many work coordinate systems have a code of their own: G54 to G59.3.
pub(super) const SYSTEMS: usize = 9;

/// How many more there are, by number: G54.1 P1 to P300.
pub(super) const FURTHER_SYSTEMS: usize = 300;

/// A work coordinate system.
#[derive(Clone, Copy, Debug)]
pub(super) struct System {
    /// Its origin in machine coordinates.
    pub origin_mm: Point,
    /// By how much X and Y are turned about that origin, counter-clockwise.
    pub turn_deg: f64,
    /// Whether profile or program have said where it lies.
    pub is_set: bool,
}

/// Scaling about a centre (G51); a negative factor mirrors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scaling {
    pub center_mm: Point,
    pub factors: AxisMap<f64>,
}

/// A rotation about a centre in a plane (G68).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rotation {
    pub plane: Plane,
    /// On the plane's first and second axis.
    pub center_mm: [f64; 2],
    pub angle_deg: f64,
}

/// All that lies between program and machine coordinates.
#[derive(Clone, Debug)]
pub(super) struct Frames {
    /// Where the systems lie: G54 to G59.3, then those of G54.1.
    systems: Vec<System>,
    /// By how much all of them are shifted (FANUC's external offset).
    external_mm: Point,
    active: usize,
    /// The one in force, as it was when it was chosen or placed.
    current: System,
    /// G92 and G52, which share one offset, and what G92.2 has suspended.
    shift_mm: Point,
    kept_shift_mm: Point,
    is_shifted: bool,
    tool_mm: Point,
    scaling: Option<Scaling>,
    rotation: Option<Rotation>,
    /// Where axes are mirrored.
    mirror_mm: AxisMap<Option<f64>>,
    /// The sum of all shifts, by which alone a plain frame differs from the machine's.
    offset_mm: Point,
    is_plain: bool,
}

impl Frames {
    /// All systems at the machine's work zero, which is meant to be that of G54.
    pub fn new(machine: &Machine) -> Frames {
        let system = System { origin_mm: machine.work_zero_mm, turn_deg: 0.0, is_set: false };
        let mut systems = vec![system; SYSTEMS + FURTHER_SYSTEMS];
        systems[0].is_set = true;
        Frames {
            current: systems[0],
            systems,
            active: 0,
            external_mm: Point::ZERO,
            shift_mm: Point::ZERO,
            kept_shift_mm: Point::ZERO,
            is_shifted: false,
            tool_mm: Point::ZERO,
            scaling: None,
            rotation: None,
            mirror_mm: AxisMap::default(),
            offset_mm: machine.work_zero_mm,
            is_plain: true,
        }
    }

    /// What program zero is in machine coordinates where [`Frames::is_plain`].
    pub fn offset_mm(&self) -> &Point {
        &self.offset_mm
    }

    /// Whether nothing turns or scales: each axis is shifted by itself.
    pub fn is_plain(&self) -> bool {
        self.is_plain
    }

    /// The work coordinate system in force, counted from 0.
    pub fn active(&self) -> usize {
        self.active
    }

    /// A work coordinate system, counted from 0.
    pub fn system(&self, index: usize) -> Option<&System> {
        self.systems.get(index)
    }

    /// The scaling in force.
    pub fn scaling(&self) -> Option<&Scaling> {
        self.scaling.as_ref()
    }

    /// The rotation in force.
    pub fn rotation(&self) -> Option<&Rotation> {
        self.rotation.as_ref()
    }

    /// Makes a work coordinate system the one in force.
    pub fn choose(&mut self, index: usize) {
        if let Some(system) = self.systems.get(index) {
            (self.active, self.current) = (index, *system);
        }
        self.update();
    }

    /// By how much all systems are shifted.
    pub fn external_mm(&self) -> &Point {
        &self.external_mm
    }

    /// Shifts all systems on one axis.
    pub fn set_external(&mut self, axis: Axis, by_mm: f64) {
        self.external_mm[axis] = by_mm;
        self.update();
    }

    /// Changes what is stored of a work coordinate system; it is in force once it is chosen.
    pub fn store_system(&mut self, index: usize, change: impl FnOnce(&mut System)) {
        if let Some(place) = self.systems.get_mut(index) {
            change(place);
            place.is_set = true;
        }
    }

    /// Places a work coordinate system.
    pub fn set_system(&mut self, index: usize, system: System) {
        if let Some(place) = self.systems.get_mut(index) {
            *place = system;
        }
        if index == self.active {
            self.current = system;
        }
        self.update();
    }

    /// Sets the offset of the tool.
    pub fn set_tool(&mut self, offset_mm: Point) {
        self.tool_mm = offset_mm;
        self.update();
    }

    /// The offset of the tool in force.
    pub fn tool_mm(&self) -> Point {
        self.tool_mm
    }

    /// Sets the offset of G92 and G52 on one axis.
    pub fn set_shift(&mut self, axis: Axis, shift_mm: f64) {
        self.shift_mm[axis] = shift_mm;
        self.kept_shift_mm = self.shift_mm;
        self.is_shifted = true;
        self.update();
    }

    /// Changes the offset that G92.3 restores.
    pub fn keep_shift(&mut self, axis: Axis, shift_mm: f64) {
        self.kept_shift_mm[axis] = shift_mm;
    }

    /// The offset that G92.3 restores.
    pub fn kept_shift_mm(&self) -> &Point {
        &self.kept_shift_mm
    }

    /// Whether G92 or G52 has set an offset, and it is not suspended.
    pub fn is_shifted(&self) -> bool {
        self.is_shifted
    }

    /// The offset of G92 and G52 in force.
    pub fn shift_mm(&self) -> Point {
        self.shift_mm
    }

    /// G92.1: the offset of G92 is zero.
    pub fn reset_shift(&mut self) {
        self.kept_shift_mm = Point::ZERO;
        self.suspend_shift();
    }

    /// G92.2: the offset of G92 is zero until G92.3.
    pub fn suspend_shift(&mut self) {
        self.shift_mm = Point::ZERO;
        self.is_shifted = false;
        self.update();
    }

    /// G92.3: the offset of G92 is what it was.
    pub fn restore_shift(&mut self) {
        self.shift_mm = self.kept_shift_mm;
        self.is_shifted = true;
        self.update();
    }

    /// Whether an axis is mirrored.
    pub fn is_mirrored(&self) -> bool {
        self.mirror_mm.0.iter().any(Option::is_some)
    }

    /// Mirrors an axis at a place, or not.
    pub fn set_mirror(&mut self, axis: Axis, at_mm: Option<f64>) {
        self.mirror_mm[axis] = at_mm;
        self.update();
    }

    /// Scales, or not.
    pub fn set_scaling(&mut self, scaling: Option<Scaling>) {
        self.scaling = scaling;
        self.update();
    }

    /// Turns, or not.
    pub fn set_rotation(&mut self, rotation: Option<Rotation>) {
        self.rotation = rotation;
        self.update();
    }

    fn update(&mut self) {
        let system = &self.current;
        self.offset_mm = AxisMap::from_fn(|axis| {
            self.origin_mm(system, axis) + self.shift_mm[axis] + self.tool_mm[axis]
        });
        self.is_plain = self.scaling.is_none()
            && self.rotation.is_none()
            && !self.is_mirrored()
            && system.turn_deg == 0.0;
    }

    /// Where the origin of a system lies on an axis.
    fn origin_mm(&self, system: &System, axis: Axis) -> f64 {
        system.origin_mm[axis] + self.external_mm[axis]
    }

    /// Machine coordinates of a point of the program.
    pub fn machine(&self, program: &Point) -> Point {
        let system = &self.current;
        let mut point = self.scaled(program);
        if let Some(rotation) = &self.rotation {
            turn(&mut point, rotation.plane, rotation.center_mm, rotation.angle_deg);
        }
        point = self.mirrored(&point);
        point = AxisMap::from_fn(|axis| point[axis] + self.shift_mm[axis]);
        turn(&mut point, Plane::Xy, [0.0; 2], system.turn_deg);
        AxisMap::from_fn(|axis| point[axis] + self.origin_mm(system, axis) + self.tool_mm[axis])
    }

    /// What the program calls a point in machine coordinates.
    pub fn program(&self, machine: &Point) -> Point {
        let mut point = self.mirrored(&self.unscaled(machine));
        if let Some(rotation) = &self.rotation {
            turn(&mut point, rotation.plane, rotation.center_mm, -rotation.angle_deg);
        }
        if let Some(scaling) = &self.scaling {
            point = AxisMap::from_fn(|axis| {
                let center = scaling.center_mm[axis];
                center + (point[axis] - center) / scaling.factors[axis]
            });
        }
        point
    }

    /// The mirror image of a point, and that of its image the point itself.
    fn mirrored(&self, point: &Point) -> Point {
        AxisMap::from_fn(|axis| {
            self.mirror_mm[axis].map_or(point[axis], |at_mm| 2.0 * at_mm - point[axis])
        })
    }

    /// A point in machine coordinates before scaling, rotation and mirror images.
    fn unscaled(&self, machine: &Point) -> Point {
        let shift_mm = self.shift_mm;
        let point = self.unshifted_by(&self.current, machine);
        AxisMap::from_fn(|axis| point[axis] - shift_mm[axis])
    }

    /// What a work coordinate system alone, with the tool's offset, makes of a machine position:
    /// what G92 and G10 L20 measure from.
    pub fn unshifted(&self, index: usize, machine: &Point) -> Point {
        self.unshifted_by(self.known(index), machine)
    }

    /// A system as it is in force, or would be if it were chosen.
    fn known(&self, index: usize) -> &System {
        self.systems.get(index).filter(|_| index != self.active).unwrap_or(&self.current)
    }

    fn unshifted_by(&self, system: &System, machine: &Point) -> Point {
        let mut point = AxisMap::from_fn(|axis| {
            machine[axis] - self.origin_mm(system, axis) - self.tool_mm[axis]
        });
        turn(&mut point, Plane::Xy, [0.0; 2], -system.turn_deg);
        point
    }

    /// Where the origin of a system has to lie for it to call `wanted` what it calls `called` now.
    pub fn origin_moved(&self, index: usize, called: &Point, wanted: &Point) -> Point {
        let system = self.known(index);
        let mut by = AxisMap::from_fn(|axis| called[axis] - wanted[axis]);
        turn(&mut by, Plane::Xy, [0.0; 2], system.turn_deg);
        AxisMap::from_fn(|axis| system.origin_mm[axis] + by[axis])
    }

    /// A point of the program after scaling.
    pub fn scaled(&self, program: &Point) -> Point {
        let Some(scaling) = &self.scaling else { return *program };
        AxisMap::from_fn(|axis| {
            let center = scaling.center_mm[axis];
            center + scaling.factors[axis] * (program[axis] - center)
        })
    }

    /// Whether arcs of a plane stay arcs, and if so whether they turn the other way round; none if
    /// unequal scaling or a rotation out of the plane distorts them.
    pub fn arcs_mirrored(&self, plane: Plane) -> Option<bool> {
        let [first, second] = plane.axes();
        let turned_out = |other: Plane, angle_deg: f64| other != plane && angle_deg % 360.0 != 0.0;
        if self.rotation.is_some_and(|rotation| turned_out(rotation.plane, rotation.angle_deg))
            || turned_out(Plane::Xy, self.current.turn_deg)
        {
            return None;
        }
        let is_image = self.mirror_mm[first].is_some() != self.mirror_mm[second].is_some();
        let Some(scaling) = &self.scaling else { return Some(is_image) };
        let [a, b] = [scaling.factors[first], scaling.factors[second]];
        (a.abs() == b.abs()).then_some(((a < 0.0) != (b < 0.0)) != is_image)
    }
}

/// Turns a point about a centre in a plane.
fn turn(point: &mut Point, plane: Plane, center: [f64; 2], angle_deg: f64) {
    if angle_deg == 0.0 {
        return;
    }
    let (sin, cos) = sin_cos_deg(angle_deg);
    let [first, second] = plane.axes();
    let [a, b] = [point[first] - center[0], point[second] - center[1]];
    point[first] = center[0] + a * cos - b * sin;
    point[second] = center[1] + a * sin + b * cos;
}

/// Sine and cosine of degrees, exact for whole quarter turns.
pub(super) fn sin_cos_deg(angle_deg: f64) -> (f64, f64) {
    let within = angle_deg.rem_euclid(360.0);
    if within % 90.0 == 0.0 {
        match (within / 90.0) as u32 {
            0 => (0.0, 1.0),
            1 => (1.0, 0.0),
            2 => (0.0, -1.0),
            _ => (-1.0, 0.0),
        }
    } else {
        libm::sincos(within.to_radians())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn what_the_program_calls_a_point_leads_there(
            at in proptest::array::uniform3(-500.0..500.0_f64),
            origin in proptest::array::uniform3(-500.0..500.0_f64),
            angles in proptest::array::uniform2(-400.0..400.0_f64),
            factors in proptest::array::uniform3(prop_oneof![-4.0..-0.1_f64, 0.1..4.0_f64]),
        ) {
            let mut frames = Frames::new(&Machine::load("starmill").unwrap());
            let point = |[x, y, z]: [f64; 3]| {
                let mut point = Point::ZERO;
                (point[Axis::X], point[Axis::Y], point[Axis::Z]) = (x, y, z);
                point
            };
            let system =
                System { origin_mm: point(origin), turn_deg: angles[0], is_set: true };
            frames.set_system(3, system);
            frames.choose(3);
            frames.set_tool(point([0.0, 1.0, 40.0]));
            frames.set_shift(Axis::X, 7.0);
            let mut scaling = Scaling { center_mm: point(origin), factors: AxisMap([1.0; 9]) };
            for (axis, factor) in Axis::LINEAR.into_iter().zip(factors) {
                scaling.factors[axis] = factor;
            }
            frames.set_scaling(Some(scaling));
            let center_mm = [at[1], at[2]];
            frames.set_mirror(Axis::Y, Some(at[0]));
            frames.set_rotation(Some(Rotation {
                plane: Plane::Yz, center_mm, angle_deg: angles[1],
            }));
            let program = frames.program(&point(at));
            let back = frames.machine(&program);
            for axis in Axis::LINEAR {
                prop_assert!((back[axis] - point(at)[axis]).abs() < 1e-8);
            }
        }
    }
}
