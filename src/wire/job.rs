//! Commands → node buffers: who takes part in each, in which order they are filled, with which
//! bytes.
//!
//! Rules: only nodes whose axis moves in a buffer are filled, one of them as master; a buffer in
//! which nothing moves is not sent; every buffer ends with zeros and at rest; events between
//! buffers stay between them. Refuses what the machine or the bus cannot do, before anything is
//! sent; whether bytes could be taken for commands is proved by [`crate::wire::lint`].

use crate::base::machine::{
    self, AxisProfile, BufferTime, Bus, COUNT_MAX_SAFE, FRAME_COUNT_MAX, FRAME_PLACES, PADS_MIN,
    Protocol, TICK_MARGIN_US, Unit,
};
use crate::base::{Axis, AxisMap, AxisSet, Command, Event, EventKind, Machine, Tick};
use crate::wire::codec;
use crate::wire::direct::Direct;
use crate::wire::error::JobError;
use crate::wire::frames::{self, Frame, Mode};
use crate::wire::nodes::ExecutedTick;
use crate::wire::order;

/// A whole job, ready for the bus.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// What happens, in order.
    pub steps: Vec<Step>,
    /// Machine position at the start, in motor steps.
    pub start_steps: AxisMap<i64>,
    /// The same in mm on the axes that the machine has; degrees on rotary axes.
    pub start_mm: AxisMap<f64>,
    /// Machine position at the end, in motor steps.
    pub end_steps: AxisMap<i64>,
    /// Least and greatest machine position of each axis that moves; degrees on rotary axes.
    pub extents_mm: AxisMap<Option<[f64; 2]>>,
    /// Ticks that the nodes execute, pads not counted.
    pub ticks: u64,
    /// Nodes that take part in any buffer, or are told anything else.
    pub nodes: Vec<Unit>,
    /// Axes that the job knows of; of others nothing is told at its end.
    pub axes: AxisSet,
    /// Axes of which nobody knows at the start where they stand.
    pub unknown: AxisSet,
}

/// One step of a job.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// A buffer is filled and executed.
    Buffer(Buffer),
    /// Something happens while all nodes are idle.
    Event(Event),
    /// A node does something by itself while all others are idle.
    Direct(Direct),
}

/// One buffer of the nodes; where they have none, one stretch of motion between two events.
#[derive(Clone, Debug, PartialEq)]
pub struct Buffer {
    /// What is spoken: how counts stand in bytes.
    pub protocol: Protocol,
    /// Number of the buffer in the plan, from 0.
    pub number: u32,
    /// Nodes that are filled, in the order of filling.
    pub fills: Vec<Fill>,
    /// NC line of each tick. All entries after them are pads.
    pub lines: Vec<u32>,
    /// Events within the buffer, each before the tick of this number.
    pub events: Vec<(usize, Event)>,
}

/// One node's part in a buffer.
#[derive(Clone, Debug, PartialEq)]
pub struct Fill {
    /// The node.
    pub unit: Unit,
    /// It answers every tick.
    pub master: bool,
    /// Its buffer, pads included; in frames two bytes a tick, and no pads.
    pub bytes: Vec<u8>,
}

impl Buffer {
    /// Signed steps of a node that is filled, in one tick.
    pub fn count(&self, fill: &Fill, tick: usize) -> i32 {
        if self.protocol == Protocol::Frame {
            let bytes = fill.bytes.get(2 * tick..2 * tick + 2);
            return bytes.map_or(0, |bytes| frames::decode([bytes[0], bytes[1]]));
        }
        fill.bytes.get(tick).map_or(0, |byte| codec::decode(*byte))
    }

    /// Ticks that each node that is filled executes, pads included.
    pub fn entries(&self) -> usize {
        match self.protocol {
            Protocol::Frame => self.lines.len(),
            _ => self.fills.first().map_or(0, |fill| fill.bytes.len()),
        }
    }

    /// The frame of a tick; nodes that are not filled get 0.
    pub(super) fn frame(&self, mode: Mode, number: u64, tick: usize) -> Frame {
        let mut places = [[0; 2]; FRAME_PLACES as usize];
        for fill in self.fills.iter().filter(|_| mode == Mode::Move) {
            let place = places.get_mut(usize::from(fill.unit.id).wrapping_sub(1));
            if let (Some(place), Some(bytes)) = (place, fill.bytes.get(2 * tick..2 * tick + 2)) {
                place.copy_from_slice(bytes);
            }
        }
        frames::frame(mode, number, &places)
    }

    /// The counts of all axes in one tick.
    pub fn counts(&self, tick: usize) -> AxisMap<i32> {
        let mut counts = AxisMap::default();
        for fill in &self.fills {
            if let Some(axis) = fill.unit.axis {
                counts[axis] = self.count(fill, tick);
            }
        }
        counts
    }

    /// What it takes beside its ticks.
    pub fn time(&self, bus: &Bus) -> BufferTime {
        let filled = self.fills.iter().filter_map(|fill| fill.unit.axis).collect();
        bus.buffer_time(self.lines.len() as f64, filled)
    }

    /// The node that answers every tick.
    pub fn master(&self) -> Option<&Fill> {
        self.fills.iter().find(|fill| fill.master)
    }
}

impl Job {
    /// Cuts a command stream in node buffers. `start_steps` is where the machine stands.
    ///
    /// # Errors
    /// The first thing that the machine, its bus or its nodes cannot do.
    pub fn new(
        commands: impl IntoIterator<Item = Command>,
        start_steps: AxisMap<i64>,
        machine: &Machine,
    ) -> Result<Job, JobError> {
        check_bus(&machine.bus)?;
        let mut cutter = Cutter::new(start_steps, machine);
        for command in commands {
            match command {
                Command::Tick(tick) => cutter.tick(tick)?,
                Command::Event(event) => cutter.event(event)?,
            }
        }
        cutter.flush()?;
        let mut nodes: Vec<Unit> = cutter.steps.iter().flat_map(participants).collect();
        nodes.sort_unstable_by_key(|unit| (unit.axis.is_none(), *unit));
        nodes.dedup();
        let low_high = cutter.extents_steps;
        let mm = |axis: Axis, steps: i64| {
            machine.axis(axis).map_or(0.0, |profile| steps as f64 / profile.steps_per_mm)
        };
        Ok(Job {
            start_steps,
            start_mm: AxisMap::from_fn(|axis| mm(axis, start_steps[axis])),
            end_steps: cutter.position,
            extents_mm: AxisMap::from_fn(|axis| {
                let [low, high] = low_high[axis];
                (low != high).then(|| [mm(axis, low), mm(axis, high)])
            }),
            ticks: cutter.steps.iter().map(ticks).sum(),
            nodes,
            steps: cutter.steps,
            axes: machine.axes.iter().map(|profile| profile.axis).collect(),
            unknown: AxisSet::EMPTY,
        })
    }

    /// The same job, which knows of these axes only.
    pub fn only(self, axes: AxisSet) -> Job {
        Job { axes, ..self }
    }

    /// The buffers, in order.
    pub fn buffers(&self) -> impl Iterator<Item = &Buffer> {
        self.steps.iter().filter_map(|step| match step {
            Step::Buffer(buffer) => Some(buffer),
            Step::Event(_) | Step::Direct(_) => None,
        })
    }

    /// The first tick, from 0, that nodes did not execute as planned, and its line; pads count as
    /// ticks of their buffer and have its last line.
    pub fn first_difference(&self, executed: &[ExecutedTick]) -> Option<(u64, u32)> {
        let mut groups = executed.chunk_by(|a, b| a.buffer == b.buffer);
        let mut before = 0;
        for buffer in self.buffers() {
            let group = groups.next().unwrap_or_default();
            for tick in 0..buffer.entries().max(group.len()) {
                if group.get(tick).is_none_or(|done| done.counts != buffer.counts(tick)) {
                    let line = buffer.lines.get(tick).or(buffer.lines.last());
                    return Some((before + tick as u64, line.copied().unwrap_or(0)));
                }
            }
            before += buffer.lines.len() as u64;
        }
        groups.next().map(|_| (before, 0))
    }

    /// All events, in order.
    pub fn events(&self) -> impl Iterator<Item = &Event> {
        self.steps.iter().flat_map(|step| match step {
            Step::Buffer(buffer) => buffer.events.iter().map(|(_, event)| event).collect(),
            Step::Event(event) => vec![event],
            Step::Direct(_) => Vec::new(),
        })
    }

    /// How long the job takes with a perfect host, in seconds: fills, ticks, pads and dwells; pauses
    /// for a person not counted.
    pub fn duration_s(&self, bus: &Bus) -> f64 {
        let buffer_s =
            |buffer: &Buffer| buffer.lines.len() as f64 * bus.tick_s() + buffer.time(bus).total_s();
        let dwells_s: f64 = self.events().map(|event| dwell_s(event.kind)).sum();
        self.buffers().map(buffer_s).sum::<f64>() + dwells_s
    }
}

/// How long an event rests by itself.
pub(super) fn dwell_s(kind: EventKind) -> f64 {
    if let EventKind::Dwell(seconds) = kind { seconds } else { 0.0 }
}

fn participants(step: &Step) -> Vec<Unit> {
    match step {
        Step::Buffer(buffer) => buffer.fills.iter().map(|fill| fill.unit).collect(),
        Step::Event(_) | Step::Direct(_) => Vec::new(),
    }
}

fn ticks(step: &Step) -> u64 {
    match step {
        Step::Buffer(buffer) => buffer.lines.len() as u64,
        Step::Event(_) | Step::Direct(_) => 0,
    }
}

fn check_bus(bus: &Bus) -> Result<(), JobError> {
    match bus.protocol {
        Protocol::None => return Err(JobError::NoProtocol),
        // Whether frames are in time is a matter of the port's baud rate: the lint looks.
        Protocol::Frame => return Ok(()),
        Protocol::Buffered => {}
    }
    if !bus.buffer_ticks.is_multiple_of(2) {
        return Err(JobError::OddBuffer { buffer_ticks: bus.buffer_ticks });
    }
    let least_us = bus.node_tick_us.saturating_add(TICK_MARGIN_US);
    if bus.tick_us < least_us {
        return Err(JobError::TickTooShort { tick_us: bus.tick_us, least_us });
    }
    Ok(())
}

/// Longest rest of a job in all: ten weeks. Times in microseconds then stay far from overflow.
const DWELLS_S_MAX: f64 = 6e6;

/// What a metronome makes in every entry: 100 steps fill its tick of 10 ms exactly.
const METRONOME_COUNT: u8 = 100;

/// Gathers the ticks and events of one buffer after another.
struct Cutter<'a> {
    machine: &'a Machine,
    steps: Vec<Step>,
    number: Option<u32>,
    ticks: Vec<Tick>,
    events: Vec<(usize, Event)>,
    position: AxisMap<i64>,
    extents_steps: AxisMap<[i64; 2]>,
    total: u64,
    dwells_s: f64,
    /// How many buffers there had been when each axis was master last.
    last_master: AxisMap<usize>,
    buffers: usize,
}

impl<'a> Cutter<'a> {
    fn new(start_steps: AxisMap<i64>, machine: &'a Machine) -> Self {
        Cutter {
            machine,
            steps: Vec::new(),
            number: None,
            ticks: Vec::new(),
            events: Vec::new(),
            position: start_steps,
            extents_steps: AxisMap::from_fn(|axis| [start_steps[axis]; 2]),
            total: 0,
            dwells_s: 0.0,
            last_master: AxisMap::default(),
            buffers: 0,
        }
    }

    fn tick(&mut self, tick: Tick) -> Result<(), JobError> {
        match self.number {
            Some(number) if tick.buffer < number => {
                return Err(JobError::BufferOrder { tick: self.total, buffer: tick.buffer });
            }
            Some(number) if tick.buffer > number => self.flush()?,
            _ => {}
        }
        self.number = Some(tick.buffer);
        for axis in Axis::ALL {
            if tick.counts[axis] != 0 {
                self.step(axis, tick.counts[axis], tick.line)?;
            }
        }
        self.ticks.push(tick);
        self.total += 1;
        Ok(())
    }

    fn event(&mut self, event: Event) -> Result<(), JobError> {
        self.dwells_s += dwell_s(event.kind);
        if self.dwells_s > DWELLS_S_MAX {
            return Err(JobError::Dwell { event, seconds_max: DWELLS_S_MAX });
        }
        // Nodes without a buffer have no place for an event in it.
        if self.machine.bus.protocol == Protocol::Frame {
            self.flush()?;
        }
        self.events.push((self.ticks.len(), event));
        Ok(())
    }

    fn step(&mut self, axis: Axis, count: i32, line: u32) -> Result<(), JobError> {
        let tick = self.total;
        let profile = self.machine.axis(axis).ok_or(JobError::NoNode { axis, tick, line })?;
        let is_frame = self.machine.bus.protocol == Protocol::Frame;
        let count_most = if is_frame { FRAME_COUNT_MAX } else { COUNT_MAX_SAFE };
        let count_max = self.machine.count_max(profile).min(count_most);
        if count.unsigned_abs() > count_max {
            return Err(JobError::Count { axis, count, count_max, tick, line });
        }
        let steps = self.position[axis].saturating_add(i64::from(count));
        if let Some([low_mm, high_mm]) = profile.travel_mm {
            let low = (low_mm * profile.steps_per_mm).round() as i64;
            let high = (high_mm * profile.steps_per_mm).round() as i64;
            // An axis may stand outside, at its home switch, and come back.
            if (steps < low && count < 0) || (steps > high && count > 0) {
                let position_mm = steps as f64 / profile.steps_per_mm;
                return Err(JobError::Travel { axis, position_mm, low_mm, high_mm, tick, line });
            }
        }
        self.position[axis] = steps;
        let [low, high] = &mut self.extents_steps[axis];
        *low = steps.min(*low);
        *high = steps.max(*high);
        Ok(())
    }

    /// Ends the buffer under way: events before its first and after its last movement come to lie
    /// between buffers.
    fn flush(&mut self) -> Result<(), JobError> {
        let mut ticks = std::mem::take(&mut self.ticks);
        let events = std::mem::take(&mut self.events);
        let moves = |tick: &Tick| tick.counts.0.iter().any(|count| *count != 0);
        let first = ticks.iter().position(moves).unwrap_or(0);
        let end = ticks.iter().rposition(moves).map_or(0, |last| last + 1);
        let base = self.total - ticks.len() as u64;
        let (before, rest): (Vec<_>, Vec<_>) =
            events.into_iter().partition(|(at, _)| *at <= first && end > 0);
        let (within, after): (Vec<_>, Vec<_>) = rest.into_iter().partition(|(at, _)| *at < end);
        let rest_until = after.first().map_or(ticks.len(), |(at, _)| *at);
        ticks.truncate(if end > 0 { rest_until } else { 0 });
        self.steps.extend(before.into_iter().map(|(_, event)| Step::Event(event)));
        if !ticks.is_empty() {
            let buffer = self.buffer(&ticks, within, base)?;
            self.steps.push(Step::Buffer(buffer));
        }
        self.steps.extend(after.into_iter().map(|(_, event)| Step::Event(event)));
        Ok(())
    }

    fn buffer(
        &mut self,
        ticks: &[Tick],
        events: Vec<(usize, Event)>,
        base: u64,
    ) -> Result<Buffer, JobError> {
        let bus = &self.machine.bus;
        if bus.protocol == Protocol::Frame {
            return self.stretch(ticks, base);
        }
        let number = self.number.unwrap_or(0);
        let motion_ticks_max = bus.buffer_ticks - PADS_MIN;
        if ticks.len() > motion_ticks_max as usize {
            let (motion_ticks, line) = (ticks.len(), ticks[0].line);
            return Err(JobError::BufferLength {
                buffer: number,
                motion_ticks,
                motion_ticks_max,
                line,
            });
        }
        self.check_rest(ticks, 0, base)?;
        self.check_rest(ticks, ticks.len(), base)?;
        for (at, event) in &events {
            if event.kind.waits_for_person() {
                let event = event.clone();
                return Err(JobError::PauseInside { buffer: number, event });
            }
            self.check_rest(ticks, *at, base)?;
        }
        let fills = self.fills(ticks, base)?;
        let lines = ticks.iter().map(|tick| tick.line).collect();
        Ok(Buffer { protocol: bus.protocol, number, fills, lines, events })
    }

    /// Motion from rest to rest, in frames.
    fn stretch(&mut self, ticks: &[Tick], base: u64) -> Result<Buffer, JobError> {
        self.check_rest(ticks, 0, base)?;
        self.check_rest(ticks, ticks.len(), base)?;
        let number = self.buffers as u32;
        self.buffers += 1;
        let fills = frames::fills(ticks, self.machine, base)?;
        let lines = ticks.iter().map(|tick| tick.line).collect();
        Ok(Buffer { protocol: Protocol::Frame, number, fills, lines, events: Vec::new() })
    }

    /// Stopping or starting here must be no greater step of speed than a corner may be: in steps a
    /// tick what the acceleration gives in a tick, or the speed that the motor starts at; and 3
    /// for what the plan's own tick of acceleration and rounding add.
    fn check_rest(&self, ticks: &[Tick], at: usize, base: u64) -> Result<(), JobError> {
        let tick_s = self.machine.bus.tick_s();
        let around = [at.checked_sub(1), Some(at)];
        for (index, tick) in around.into_iter().flatten().filter_map(|i| Some((i, ticks.get(i)?))) {
            for profile in &self.machine.axes {
                let speed_mm_s = (profile.accel_max_mm_s2 * tick_s).max(profile.start_speed_mm_s);
                let steps_max = (speed_mm_s * tick_s * profile.steps_per_mm + 3.0) as u32;
                let (axis, count) = (profile.axis, tick.counts[profile.axis]);
                if count.unsigned_abs() > steps_max {
                    let (tick, line) = (base + index as u64, tick.line);
                    return Err(JobError::NotAtRest { axis, count, steps_max, tick, line });
                }
            }
        }
        Ok(())
    }

    /// Each moving node's bytes, in an order of filling in which no node takes another's data for
    /// a fill command. A node that must be full before others are filled, though it rests, gets
    /// zeros.
    fn fills(&mut self, ticks: &[Tick], base: u64) -> Result<Vec<Fill>, JobError> {
        let bus = &self.machine.bus;
        let entries = bus.buffer_ticks as usize;
        let metronome = bus.metronome_id.filter(|_| bus.master == machine::Master::Metronome);
        let master = if metronome.is_some() { None } else { self.master(ticks) };
        let beat = |id| Fill {
            unit: Unit { axis: None, id },
            master: true,
            bytes: vec![METRONOME_COUNT; entries],
        };
        let mut fills: Vec<Fill> = metronome.map(beat).into_iter().collect();
        for AxisProfile { axis, .. } in &self.machine.axes {
            let axis = *axis;
            let moves = ticks.iter().any(|tick| tick.counts[axis] != 0);
            if !moves && master != Some(axis) {
                continue;
            }
            let id = *bus.nodes.get(&axis).ok_or_else(|| {
                let moving = ticks.iter().zip(base..).find(|(tick, _)| tick.counts[axis] != 0);
                let (tick, line) = moving.map_or((base, 0), |(tick, at)| (at, tick.line));
                JobError::NoNode { axis, tick, line }
            })?;
            let mut bytes = vec![0; entries];
            for (byte, tick) in bytes.iter_mut().zip(ticks) {
                // Counts were held to 119 when the tick came.
                *byte = codec::encode(tick.counts[axis]).unwrap_or(0);
            }
            let unit = Unit { axis: Some(axis), id };
            fills.push(Fill { unit, master: master == Some(axis), bytes });
        }
        let units: Vec<Unit> = bus.units().collect();
        order::fill_order(fills, &units).map_err(|clash| JobError::clash(clash, base, ticks))
    }

    /// The axis whose node answers every tick. The one that moves in most ticks gives the best
    /// supervision, each in turn shows every dead one; ties in profile order.
    fn master(&mut self, ticks: &[Tick]) -> Option<Axis> {
        self.buffers += 1;
        let moving = |axis: Axis| ticks.iter().filter(|tick| tick.counts[axis] != 0).count();
        let axes = self.machine.axes.iter().map(|profile| profile.axis);
        let master = match self.machine.bus.master {
            machine::Master::Axis(axis) => Some(axis),
            machine::Master::Rotate => {
                axes.filter(|axis| moving(*axis) > 0).min_by_key(|axis| self.last_master[*axis])
            }
            // The last of equal ones would win, so they come in reverse.
            _ => axes.rev().max_by_key(|axis| moving(*axis)),
        }?;
        self.last_master[master] = self.buffers;
        Some(master)
    }
}
