//! Forwards: speeding up with jerk below the ceiling, with its peaks rounded.
//!
//! ```text
//!  v ┤        P ,--.                 A peak is where the acceleration would have to fall at once:
//!    │        /      `.  Q           where speeding up meets the ceiling, where the ceiling
//!    │      ,'         \             breaks, where a piece allows less. From P on it falls with
//!    │   ,-'            \  ceiling   the jerk, so late that the arc just touches, at Q.
//!    │_-'                `-._
//! ```
//!
//! All motions below the ceiling whose acceleration never falls faster than the jerk allows have a
//! greatest one, and that is it: the later P, the faster. Where P cannot be found (rounding), the
//! acceleration steps: speeds and accelerations stay within their limits whatever happens.

use super::Run;
use super::bracket::Bracket;
use super::lane::Lane;
use super::stretch::{SAME, State, Stretch};

/// How exactly P is found.
const P_ERROR_S: f64 = 1e-11;

/// The same as a share of a step of acceleration.
const P_ERROR_SHARE: f64 = 1e-8;

/// Steps of Newton's method for a first guess of P at most: each doubles the digits.
const NEWTON_MAX: usize = 8;

/// An arc this near to the ceiling, as a share of its speed, touches it: twice what counts as the same.
const TOUCH_ERROR: f64 = 2.0 * SAME;

/// An arc is furthest above a lane where it gains nothing on it, but for this share of what it gained.
const GAIN_ERROR: f64 = 1e-6;

/// An arc has the acceleration of the ceiling where it touches, but for this share of the greatest:
/// what is left of the error in its place.
const LANDING_SHARE: f64 = 1e-3;

/// It has its speed there, but for this share.
const LANDING_SPEED: f64 = 1e-6;

/// What is nearer to the ceiling than this share of its speed is on it.
const ON_CEILING: f64 = 1e-7;

/// Places nearer to each other than this share of them are the same, but for rounding.
const PLACE_ERROR: f64 = 1e-12;

/// A part of the motion.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    pub stretch: Stretch,
    /// Number of its piece.
    pub run: usize,
    /// Where the arc ends that it belongs to; its own end, if it belongs to none.
    pub lands_mm: f64,
}

impl Part {
    /// The same, with places and pieces counted from others on.
    pub fn counted_from(&self, at_mm: f64, run: usize) -> Part {
        let mut stretch = self.stretch;
        stretch.from.at_mm -= at_mm;
        Part { stretch, run: self.run - run, lands_mm: self.lands_mm - at_mm }
    }
}

/// Where an arc would leave what is allowed.
#[derive(Clone, Copy, Debug)]
struct Hit {
    at_mm: f64,
    /// The ceiling there; none at a piece that allows less acceleration.
    ceiling: Option<State>,
}

/// How near an arc comes to what is not allowed.
#[derive(Clone, Copy, Debug)]
struct Reach {
    /// By which share of the ceiling's speed it is above; below zero, by which it stays below. Infinite where
    /// there is no measure of it.
    excess: f64,
    /// Where that is.
    place: Option<Hit>,
}

impl Reach {
    /// It stays away.
    const CLEAR: Reach = Reach { excess: f64::NEG_INFINITY, place: None };

    fn is_over(&self) -> bool {
        self.excess > 0.0
    }

    /// Whether it is as near as it can be without being over.
    fn touches(&self) -> bool {
        self.excess <= 0.0 && self.excess >= -TOUCH_ERROR
    }
}

/// What a climb or the ceiling itself offers next.
struct Offer {
    stretches: [Stretch; 2],
    end: State,
    /// It ends on the ceiling.
    follows: bool,
    /// It ends where the lane does, and not before by meeting the ceiling.
    ends_lane: bool,
}

/// Where an arc begins: the way to it, and where it touches.
struct Leave {
    before: [Stretch; 2],
    from: State,
    hit: Hit,
}

/// What is found once of a lane of the ceiling.
#[derive(Clone, Copy, Debug)]
struct Outlook {
    /// The step of acceleration that is allowed at its ends.
    step_mm_s2: f64,
    /// Where the ceiling breaks next at or after its end.
    break_mm: f64,
    /// The greatest braking of the ceiling from there on.
    braking_mm_s2: f64,
}

/// Rounds the peaks below a ceiling.
#[derive(Debug)]
pub struct Rounding<'a> {
    lanes: &'a [Lane],
    runs: &'a [Box<Run>],
    /// One for each lane.
    outlooks: Vec<Outlook>,
    state: State,
    follows: bool,
    lane: usize,
    parts: Vec<Part>,
}

impl<'a> Rounding<'a> {
    /// From a state at the start of the lanes, on the ceiling or below it; or above it, where there is
    /// a motion from there on that was found below another ceiling: it is kept as far as it is above.
    pub fn new(
        lanes: &'a [Lane],
        runs: &'a [Box<Run>],
        state: State,
        held: Vec<Part>,
    ) -> Rounding<'a> {
        let own = |lane: &Lane| Outlook {
            step_mm_s2: lane.step_mm_s2(&runs[lane.run].piece),
            break_mm: f64::INFINITY,
            braking_mm_s2: (-lane.stretch.from.accel_mm_s2).max(0.0),
        };
        let mut outlooks: Vec<Outlook> = lanes.iter().map(own).collect();
        for i in (1..lanes.len()).rev() {
            let (before, next_mm_s2) = (&lanes[i - 1], lanes[i].stretch.from.accel_mm_s2);
            let next = outlooks[i];
            let breaks = before.stretch.end().accel_mm_s2 - next_mm_s2 > next.step_mm_s2;
            let outlook = &mut outlooks[i - 1];
            outlook.break_mm = if breaks { before.end_mm } else { next.break_mm };
            outlook.braking_mm_s2 = outlook.braking_mm_s2.max(next.braking_mm_s2);
        }
        let mut rounding =
            Rounding { lanes, runs, outlooks, state, follows: false, lane: 0, parts: Vec::new() };
        rounding.begin(held);
        rounding
    }

    /// Keeps a motion up to where the ceiling is above it.
    fn begin(&mut self, held: Vec<Part>) {
        for mut part in held.into_iter().filter(|part| part.stretch.duration_s > 0.0) {
            if !self.is_above(&self.state) {
                break;
            }
            let (mut low_s, mut high_s) = (0.0, part.stretch.duration_s);
            while !self.is_above(&part.stretch.after(high_s)) && high_s - low_s > P_ERROR_S {
                let middle_s = 0.5 * (low_s + high_s);
                let above = self.is_above(&part.stretch.after(middle_s));
                *if above { &mut low_s } else { &mut high_s } = middle_s;
            }
            part.stretch.duration_s = high_s;
            self.state = part.stretch.end();
            self.parts.push(part);
        }
        let ceiling_mm_s = self.ceiling_mm_s(self.state.at_mm);
        self.follows = self.state.speed_mm_s >= ceiling_mm_s * (1.0 - ON_CEILING);
    }

    fn is_above(&self, state: &State) -> bool {
        state.speed_mm_s > self.ceiling_mm_s(state.at_mm) * (1.0 + ON_CEILING)
    }

    fn ceiling_mm_s(&self, at_mm: f64) -> f64 {
        let next = self.lanes.partition_point(|lane| lane.end_mm <= at_mm);
        let lane = self.lanes.get(next).or(self.lanes.last());
        lane.map_or(0.0, |lane| lane.at(at_mm).speed_mm_s)
    }

    /// The motion, part by part.
    pub fn run(mut self) -> Vec<Part> {
        self.parts.reserve(self.lanes.len() + 16);
        while let Some(lane) = self.lanes.get(self.lane) {
            if self.state.at_mm >= lane.end_mm {
                self.lane += 1;
                continue;
            }
            let offer = self.offer(lane);
            let beyond = self.beyond(&offer);
            if beyond.is_over() {
                self.turn(&offer, beyond);
            } else {
                self.accept(&offer);
            }
        }
        self.parts
    }

    fn offer(&self, lane: &Lane) -> Offer {
        let rest = lane.stretch.since(self.state.at_mm);
        let step_mm_s2 = self.outlooks[self.lane].step_mm_s2;
        if self.follows && rest.from.accel_mm_s2 <= self.state.accel_mm_s2 + step_mm_s2 {
            let mut end = State { at_mm: lane.end_mm, ..rest.end() };
            if let Some(next) = self.lanes.get(self.lane + 1) {
                let drop_mm_s2 = end.accel_mm_s2 - next.stretch.from.accel_mm_s2;
                if drop_mm_s2 > 0.0 && drop_mm_s2 <= self.outlooks[self.lane + 1].step_mm_s2 {
                    end.accel_mm_s2 = next.stretch.from.accel_mm_s2;
                }
            }
            let none = Stretch { from: end, jerk_mm_s3: 0.0, duration_s: 0.0 };
            return Offer { stretches: [rest, none], end, follows: true, ends_lane: true };
        }
        let run = &self.runs[lane.run];
        let accel_max_mm_s2 = run.speeding_up_mm_s2(self.state.speed_mm_s);
        let climb = lane.climb(self.state, accel_max_mm_s2, &run.piece.jerk);
        Offer {
            stretches: climb.stretches,
            end: climb.end(lane),
            follows: climb.meets,
            ends_lane: !climb.meets,
        }
    }

    /// How near the arc from the end of what is offered comes: a peak behind it can be rounded, or not.
    fn beyond(&self, offer: &Offer) -> Reach {
        // No arc from the ceiling leaves it before it breaks.
        let is_on = offer.follows && offer.ends_lane;
        if is_on && self.is_before_break(&offer.end, self.lane) {
            return Reach::CLEAR;
        }
        self.sweep(offer.end, self.lane + usize::from(offer.ends_lane))
    }

    /// Whether an arc from a state in a lane brakes as the ceiling does anywhere, before that breaks
    /// again.
    fn is_before_break(&self, state: &State, lane: usize) -> bool {
        let piece = &self.runs[self.lanes[lane].run].piece;
        let State { at_mm, speed_mm_s, accel_mm_s2 } = *state;
        let jerk_mm_s3 = piece.jerk.jerk_mm_s3(speed_mm_s, accel_mm_s2);
        let turn_s = 2.0 * (accel_mm_s2.abs() + self.outlooks[lane].braking_mm_s2) / jerk_mm_s3;
        let reach_mm = (speed_mm_s + accel_mm_s2.abs() * turn_s) * turn_s;
        at_mm + reach_mm < self.outlooks[lane].break_mm
    }

    fn accept(&mut self, offer: &Offer) {
        let run = self.lanes[self.lane].run;
        for stretch in offer.stretches.iter().filter(|stretch| stretch.duration_s > 0.0) {
            let lands_mm = stretch.from.at_mm;
            self.parts.push(Part { stretch: *stretch, run, lands_mm });
        }
        self.state = offer.end;
        self.follows = offer.follows;
        self.lane += usize::from(offer.ends_lane);
    }

    /// Leaves what is offered at the last place from which an arc is allowed, and follows the arc.
    fn turn(&mut self, offer: &Offer, beyond: Reach) {
        let Some(Leave { before, from, hit }) = self.leave(offer, beyond) else {
            return self.accept(offer);
        };
        let (run, count) = (self.lanes[self.lane].run, self.parts.len());
        for stretch in before.into_iter().filter(|stretch| stretch.duration_s > 0.0) {
            self.parts.push(Part { stretch, run, lands_mm: stretch.from.at_mm });
        }
        if hit.at_mm <= self.state.at_mm {
            self.state = from;
        } else if !self.arc(from, hit) {
            self.parts.truncate(count);
            self.accept(offer);
        }
    }

    /// The last place on what is offered from which an arc is allowed, if there is one.
    fn leave(&self, offer: &Offer, beyond: Reach) -> Option<Leave> {
        let ([first, second], accel_mm_s2) = (offer.stretches, self.state.accel_mm_s2);
        let none = Stretch { duration_s: 0.0, ..first };
        let is_double = second.duration_s > 0.0;
        let tried = self.try_guess(if is_double { &second } else { &first }, beyond);
        let leave = |(stretch, hit): (Stretch, Hit), is_second: bool| {
            let before = if is_second { [first, stretch] } else { [stretch, none] };
            Leave { before, from: stretch.end(), hit }
        };
        // If that touches, no arc from before it is above.
        if let Some((duration_s, reach)) = tried.filter(|(_, reach)| reach.touches()) {
            let stretch = if is_double { second } else { first };
            return Some(leave((Stretch { duration_s, ..stretch }, reach.place?), is_double));
        }
        let start = self.sweep(self.state, self.lane);
        if start.is_over() {
            return None;
        }
        // Between bent pieces the acceleration may step up: then P lies within the step.
        let step_mm_s2 = first.from.accel_mm_s2 - accel_mm_s2;
        let risen = if step_mm_s2 > 0.0 { self.sweep(first.from, self.lane) } else { start };
        if risen.is_over() {
            let at = |share| State { accel_mm_s2: accel_mm_s2 + share * step_mm_s2, ..self.state };
            let (share, hit) =
                self.last_free([0.0, 1.0], [start, risen], None, P_ERROR_SHARE, at)?;
            return Some(Leave { before: [none; 2], from: at(share), hit });
        }
        let on = |stretch: Stretch, ends: [Reach; 2], tried: Option<(f64, Reach)>| {
            let (range_s, at) = ([0.0, stretch.duration_s], |time_s| stretch.after(time_s));
            let (duration_s, hit) = self.last_free(range_s, ends, tried, P_ERROR_S, at)?;
            Some((Stretch { duration_s, ..stretch }, hit))
        };
        if !is_double {
            return Some(leave(on(first, [risen, beyond], tried)?, false));
        }
        let middle = self.sweep(second.from, self.lane);
        if middle.is_over() {
            let tried = self.try_guess(&first, middle);
            return Some(leave(on(first, [risen, middle], tried)?, false));
        }
        Some(leave(on(second, [middle, beyond], tried)?, true))
    }

    /// When an arc leaves a stretch by the formulas, and how near that comes.
    fn try_guess(&self, stretch: &Stretch, end: Reach) -> Option<(f64, Reach)> {
        let time_s = self.guess_s(stretch, end)?;
        Some((time_s, self.sweep(stretch.after(time_s), self.lane)))
    }

    /// When an arc leaves a stretch that touches the ceiling which the arc from its end comes too near to, if
    /// that has a steady acceleration A: with S, V and a those of the stretch, and T = (a - A)/j, the arc ends at
    ///
    /// ```text
    /// v = V + (a² - A²)/2j    s = S + V·T + a·T²/2 - j·T³/6    where v² - 2·A·s has to be the ceiling's
    /// ```
    ///
    /// Found by Newton's method.
    fn guess_s(&self, stretch: &Stretch, end: Reach) -> Option<f64> {
        let ceiling = end.place?.ceiling?;
        let down_mm_s3 = self.jerk_mm_s3(&self.lanes[self.lane], &stretch.end());
        let mut time_s = stretch.duration_s;
        for _ in 0..NEWTON_MAX {
            let from = stretch.after(time_s);
            let turn_s = (from.accel_mm_s2 - ceiling.accel_mm_s2) / down_mm_s3;
            let arc = from.after(-down_mm_s3, turn_s);
            let off_mm = arc.at_mm - ceiling.at_mm;
            let over_sq = arc.speed_sq() - ceiling.speed_sq() - 2.0 * ceiling.accel_mm_s2 * off_mm;
            // What leaving later changes, by the time.
            let longer = 1.0 + stretch.jerk_mm_s3 / down_mm_s3;
            let faster_mm_s2 = longer * from.accel_mm_s2;
            let further_mm_s = longer * (from.speed_mm_s + from.accel_mm_s2 * turn_s);
            let slope = 2.0 * (arc.speed_mm_s * faster_mm_s2 - ceiling.accel_mm_s2 * further_mm_s);
            let step_s = over_sq / slope;
            time_s -= step_s;
            if step_s.abs() <= P_ERROR_S {
                break;
            }
        }
        (time_s > 0.0 && time_s < stretch.duration_s).then_some(time_s)
    }

    /// The last place of a range from which an arc is allowed, and where that touches, if the arc from its
    /// start is and that from its end is not.
    fn last_free(
        &self,
        range: [f64; 2],
        ends: [Reach; 2],
        mut tried: Option<(f64, Reach)>,
        error: f64,
        at: impl Fn(f64) -> State,
    ) -> Option<(f64, Hit)> {
        if !ends[1].is_over() {
            return None;
        }
        let mut bracket = Bracket::new(range, ends.map(|reach| reach.excess));
        let mut hit = ends[1].place?;
        let look = |place| (place, self.sweep(at(place), self.lane));
        while let Some((place, reach)) = tried.take().or_else(|| bracket.guess(error).map(look)) {
            bracket.take(place, reach.excess);
            if reach.is_over() || reach.touches() {
                hit = reach.place?;
            }
            if reach.touches() {
                break;
            }
        }
        Some((bracket.low, hit))
    }

    /// Follows the arc from a state to where it touches; not if it does not touch there.
    fn arc(&mut self, from: State, hit: Hit) -> bool {
        let (mut state, mut number) = (from, self.lane);
        while state.at_mm < hit.at_mm {
            let Some(lane) = self.lanes.get(number) else { return false };
            if state.at_mm >= lane.end_mm {
                number += 1;
                continue;
            }
            let end_mm = lane.end_mm.min(hit.at_mm);
            let (grow, grown) = self.growing(number, &state, end_mm);
            let (mut stretches, mut end) = ([grow, Stretch { duration_s: 0.0, ..grow }], grown);
            if grown.at_mm < end_mm {
                let left_mm = end_mm - grown.at_mm;
                if grown.speed_sq() <= -2.0 * grown.accel_mm_s2 * left_mm {
                    return false;
                }
                let duration_s = grown.time_over_s(left_mm, 0.0, f64::INFINITY);
                let stay = Stretch { from: grown, jerk_mm_s3: 0.0, duration_s };
                (stretches[1], end) = (stay, State { at_mm: end_mm, ..stay.end() });
            }
            for stretch in stretches.into_iter().filter(|stretch| stretch.duration_s > 0.0) {
                self.parts.push(Part { stretch, run: lane.run, lands_mm: hit.at_mm });
            }
            state = end;
        }
        if hit.ceiling.is_some() {
            let lane = &self.lanes[number];
            let ceiling = lane.at(hit.at_mm);
            if (state.speed_mm_s - ceiling.speed_mm_s).abs() > LANDING_SPEED * ceiling.speed_mm_s {
                return false;
            }
            state.speed_mm_s = ceiling.speed_mm_s;
            let off_mm_s2 = (state.accel_mm_s2 - ceiling.accel_mm_s2).abs();
            if off_mm_s2 <= LANDING_SHARE * self.runs[lane.run].piece.accel_max_mm_s2() {
                state.accel_mm_s2 = ceiling.accel_mm_s2;
            }
        }
        // In a valley the ceiling goes on steeper than the arc: it is the next lane that counts.
        let end_mm = self.lanes[number].end_mm;
        if end_mm - state.at_mm <= PLACE_ERROR * end_mm.abs() {
            state.at_mm = end_mm;
            number += 1;
        }
        (self.state, self.lane, self.follows) = (state, number, hit.ceiling.is_some());
        true
    }

    /// How the braking of an arc grows with the jerk from a state in a lane, up to what the axes stand, or
    /// the ceiling asks for; and where it has, unless a place or rest comes before.
    fn growing(&self, number: usize, from: &State, end_mm: f64) -> (Stretch, State) {
        let lane = &self.lanes[number];
        let down_mm_s2 = self.runs[lane.run].braking_mm_s2(from.speed_mm_s);
        let down_mm_s2 = down_mm_s2.max(self.outlooks[number].braking_mm_s2);
        let from = State { accel_mm_s2: from.accel_mm_s2.max(-down_mm_s2), ..*from };
        let jerk_mm_s3 = self.jerk_mm_s3(lane, &from);
        let brakes_s = (from.accel_mm_s2 + down_mm_s2) / jerk_mm_s3;
        let grow = |duration_s| Stretch { from, jerk_mm_s3: -jerk_mm_s3, duration_s };
        let (mut range_s, mut grown) = (brakes_s, grow(brakes_s).end());
        if grown.speed_mm_s < 0.0 {
            range_s = stop_s(&from, jerk_mm_s3);
            grown = grow(range_s).end();
        }
        if grown.at_mm < end_mm {
            return (grow(range_s), grown);
        }
        let grow = grow(from.time_over_s(end_mm - from.at_mm, -jerk_mm_s3, range_s));
        (grow, State { at_mm: end_mm, ..grow.end() })
    }

    /// Whether a piece that begins with a lane allows less acceleration than a state has.
    fn is_too_much(&self, number: usize, state: &State) -> bool {
        let lane = &self.lanes[number];
        if state.accel_mm_s2 <= lane.stretch.from.accel_mm_s2.max(0.0) {
            return false;
        }
        let run = &self.runs[lane.run];
        let up_mm_s2 = run.speeding_up_mm_s2(state.speed_mm_s);
        let up_mm_s2 = up_mm_s2.max(lane.stretch.from.accel_mm_s2);
        state.accel_mm_s2 > up_mm_s2 * (1.0 + SAME) + self.outlooks[number].step_mm_s2
    }

    fn jerk_mm_s3(&self, lane: &Lane, state: &State) -> f64 {
        self.runs[lane.run].piece.jerk.jerk_mm_s3(state.speed_mm_s, state.accel_mm_s2)
    }

    /// How near the arc from a state in a lane comes to what is not allowed.
    fn sweep(&self, from: State, first: usize) -> Reach {
        let (mut state, mut nearest) = (from, Reach::CLEAR);
        let mut run_before = if first > 0 { Some(self.lanes[first - 1].run) } else { None };
        for (lane, number) in self.lanes[first..].iter().zip(first..) {
            let entered = run_before.replace(lane.run) != Some(lane.run);
            if state.at_mm >= lane.end_mm {
                continue;
            }
            let falls = state.accel_mm_s2 <= lane.accel_mm_s2(state.at_mm);
            if falls && !lane.is_over(&state) && self.is_before_break(&state, number) {
                return nearest;
            }
            if entered && self.is_too_much(number, &state) {
                let hit = Hit { at_mm: state.at_mm, ceiling: None };
                return Reach { excess: f64::INFINITY, place: Some(hit) };
            }
            let (arc, end) = self.growing(number, &state, lane.end_mm);
            let reach = touch(&arc, lane);
            if reach.is_over() {
                return reach;
            }
            if reach.excess > nearest.excess {
                nearest = reach;
            }
            // Once its braking is the greatest it comes no nearer.
            if end.at_mm < lane.end_mm || end.accel_mm_s2 <= -self.outlooks[number].braking_mm_s2 {
                return nearest;
            }
            state = end;
        }
        nearest
    }
}

/// How an arc comes to a lane where it is nearest to it, or furthest above.
fn touch(arc: &Stretch, lane: &Lane) -> Reach {
    let reach = |state: &State| {
        let ceiling = lane.at(state.at_mm);
        let place = Some(Hit { at_mm: state.at_mm, ceiling: Some(ceiling) });
        Reach { excess: state.excess(&ceiling), place }
    };
    let only_over = |reach: Reach| if reach.is_over() { reach } else { Reach::CLEAR };
    let gains_mm_s2 = |state: &State| state.accel_mm_s2 - lane.accel_mm_s2(state.at_mm);
    let end = arc.end();
    let last_mm_s2 = gains_mm_s2(&end);
    if last_mm_s2 > 0.0 {
        return only_over(reach(&end));
    }
    let first_mm_s2 = gains_mm_s2(&arc.from);
    // On the ceiling it gains nothing but rounding.
    if first_mm_s2 <= SAME * (arc.from.accel_mm_s2.abs() + end.accel_mm_s2.abs()) {
        return only_over(reach(&arc.from));
    }
    let time_s = if lane.stretch.jerk_mm_s3 == 0.0 {
        first_mm_s2 / -arc.jerk_mm_s3
    } else {
        // Its height changes with the square of what is left of the gain.
        let loses_mm_s2 = |time_s| -gains_mm_s2(&arc.after(time_s));
        let bracket = Bracket::new([0.0, arc.duration_s], [-first_mm_s2, -last_mm_s2]);
        bracket.solve(P_ERROR_S, GAIN_ERROR * first_mm_s2, loses_mm_s2)
    };
    reach(&arc.after(time_s))
}

/// When the speed is zero with the acceleration falling.
fn stop_s(state: &State, jerk_mm_s3: f64) -> f64 {
    let State { speed_mm_s, accel_mm_s2, .. } = *state;
    let root = (accel_mm_s2 * accel_mm_s2 + 2.0 * jerk_mm_s3 * speed_mm_s.max(0.0)).sqrt();
    if accel_mm_s2 >= 0.0 {
        (accel_mm_s2 + root) / jerk_mm_s3
    } else {
        2.0 * speed_mm_s.max(0.0) / (root - accel_mm_s2)
    }
}
