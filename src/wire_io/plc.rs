//! Events → functions given to a PLC by handshake, on a line of its own.
//!
//! Rule: a function that its block's motion comes before is put out when that motion begins, so that the
//! PLC may be ready, and gets DEN when it is over; nothing moves on before the PLC has said that it is done. What
//! fails while axes move is told when they rest. What a function means is the PLC's.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::base::machine::PlcProfile;
use crate::base::{AxisMap, Event};
use crate::systems::plc::message::{self, Ear, NC_BYTES, PLC_BYTES};
use crate::systems::plc::{Function, Nc, Plc, Sample, Signals, Times, functions};
use crate::wire::{EventBlock, InForce, Job};
use crate::wire_io::hands::Hands;
use crate::wire_io::link::{LinkError, Port};

/// How often levels that do not change are sent again.
const AGAIN_US: u64 = 50_000;
/// A PLC that has not been heard for so long is gone.
const SILENT_US: u64 = 1_000_000;
/// How often the line is looked at while axes move.
const LOOK_US: u64 = 1000;

/// A line to a PLC.
trait Line {
    fn now_us(&mut self) -> u64;
    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError>;
    fn receive(&mut self, bytes: &mut Vec<u8>) -> Result<(), LinkError>;
    /// The bus's time is this now, if the line has no clock of its own.
    fn follow(&mut self, _bus_us: u64) {}
    /// Lets time pass, until then or until the PLC does something; false where it passes by itself.
    fn pass(&mut self, _until_us: u64) -> bool {
        false
    }
}

/// A PLC at a port.
struct Wired<P> {
    port: P,
    start: Instant,
}

impl<P: Port> Line for Wired<P> {
    fn now_us(&mut self) -> u64 {
        self.start.elapsed().as_micros() as u64
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.port.write(bytes)
    }

    fn receive(&mut self, bytes: &mut Vec<u8>) -> Result<(), LinkError> {
        let mut piece = [0; 256];
        let count = self.port.read(&mut piece, Duration::ZERO)?;
        bytes.extend_from_slice(piece.get(..count).unwrap_or_default());
        Ok(())
    }
}

/// A PLC within this program, whose time passes when nothing else happens.
struct Simulated {
    plc: Plc,
    ear: Ear<NC_BYTES>,
    now_us: u64,
    /// Time that has passed on this line alone.
    ahead_us: u64,
    told: Option<bool>,
}

impl Line for Simulated {
    fn now_us(&mut self) -> u64 {
        self.now_us
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        for byte in bytes {
            if let Some(signals) = self.ear.nc(*byte) {
                self.plc.hear(self.now_us, signals);
            }
        }
        Ok(())
    }

    fn receive(&mut self, bytes: &mut Vec<u8>) -> Result<(), LinkError> {
        self.plc.advance(self.now_us);
        let fin = self.plc.fin();
        if self.told.replace(fin) != Some(fin) {
            bytes.extend(message::of_plc(fin));
        }
        Ok(())
    }

    fn follow(&mut self, bus_us: u64) {
        self.now_us = self.now_us.max(bus_us + self.ahead_us);
    }

    fn pass(&mut self, until_us: u64) -> bool {
        if self.told != Some(self.plc.fin()) {
            return true;
        }
        let next_us = self.plc.next_us().unwrap_or(until_us).min(until_us).max(self.now_us);
        self.ahead_us += next_us - self.now_us;
        self.now_us = next_us;
        true
    }
}

/// Gives functions to a PLC.
pub struct PlcRunner {
    line: Box<dyn Line>,
    /// The PLC is heard by a clock, and may be gone.
    is_wired: bool,
    nc: Nc,
    ear: Ear<PLC_BYTES>,
    /// Events of the job, and how many of them have been begun.
    blocks: Vec<EventBlock>,
    begun: usize,
    /// Functions of the event under way that are still to come.
    waiting: VecDeque<Function>,
    /// The next event's first function has been put out while its block moves.
    is_ahead: bool,
    told: Option<Signals>,
    told_us: u64,
    heard_us: Option<u64>,
    looked_us: u64,
    ticks: u64,
    now: Sample,
    samples: Vec<Sample>,
    failed: Option<String>,
    /// The event under way, and those that are done.
    event: Option<Event>,
    done: Vec<Event>,
}

impl PlcRunner {
    /// With a PLC at a port.
    pub fn wired(port: impl Port + 'static, profile: &PlcProfile) -> PlcRunner {
        PlcRunner::new(Box::new(Wired { port, start: Instant::now() }), true, profile)
    }

    /// With a PLC within this program.
    pub fn simulated(plc: Plc, profile: &PlcProfile) -> PlcRunner {
        let (ear, told) = (Ear::default(), None);
        let line = Simulated { plc, ear, now_us: 0, ahead_us: 0, told };
        PlcRunner::new(Box::new(line), false, profile)
    }

    fn new(line: Box<dyn Line>, is_wired: bool, profile: &PlcProfile) -> PlcRunner {
        let times = Times {
            tmf_us: u64::from(profile.tmf_ms) * 1000,
            tfin_us: u64::from(profile.tfin_ms) * 1000,
            timeout_us: (profile.timeout_s * 1e6) as u64,
        };
        PlcRunner {
            line,
            is_wired,
            nc: Nc::new(times),
            ear: Ear::default(),
            blocks: Vec::new(),
            begun: 0,
            waiting: VecDeque::new(),
            is_ahead: false,
            told: None,
            told_us: 0,
            heard_us: None,
            looked_us: 0,
            ticks: 0,
            now: Sample::default(),
            samples: vec![Sample::default()],
            failed: None,
            event: None,
            done: Vec::new(),
        }
    }

    /// Looks whether a job's events can be told by codes.
    ///
    /// # Errors
    /// In words, with the line of the first that cannot.
    pub fn check(job: &Job) -> Result<(), String> {
        let told = |event: &Event| functions(event.kind).map(drop);
        job.events().try_for_each(|event| {
            told(event).map_err(|reason| format!("line {}: {reason}", event.line))
        })
    }

    /// Waits until the PLC is heard, for a second at most.
    ///
    /// # Errors
    /// In words, when it is not there or keeps FIN on.
    pub fn connect(&mut self) -> Result<(), String> {
        while self.heard_us.is_none() {
            let now_us = self.line.now_us();
            if now_us > SILENT_US {
                return Err(
                    "the PLC says nothing on its port: is it on, and at this baud rate?".into()
                );
            }
            self.pump(now_us)?;
            std::thread::sleep(Duration::from_millis(2));
        }
        match self.nc.fin() {
            true => {
                Err("the PLC gives FIN though nothing was asked: it has not ended what was before"
                    .into())
            }
            false => Ok(()),
        }
    }

    /// The job that is about to run.
    pub fn begin_job(&mut self, job: &Job) {
        self.blocks = job.event_blocks();
    }

    /// So many ticks of the job have been executed, the last of them at this time of the bus.
    pub fn progress(&mut self, ticks: u64, bus_us: u64) {
        if ticks > self.ticks {
            self.ticks = ticks;
            self.line.follow(bus_us);
            let now_us = self.line.now_us();
            self.record(now_us, true);
            let block = self.blocks.get(self.begun).filter(|_| !self.is_ahead);
            let from = block.and_then(|block| block.motion_from).filter(|from| ticks > *from);
            if let (Some(block), Some(_)) = (block, from) {
                let (event, line) = (block.event.kind, block.event.line);
                if let Some(function) = functions(event).ok().and_then(|list| list.first().copied())
                {
                    self.is_ahead = true;
                    self.now.line = line;
                    self.nc.begin(now_us, function, true);
                    self.look(now_us);
                }
            }
        }
        let now_us = self.line.now_us();
        let every_us = if self.nc.is_done() { AGAIN_US } else { LOOK_US };
        if now_us >= self.looked_us + every_us {
            self.look(now_us);
        }
    }

    /// All signals, each time that one has changed.
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// What functions that are done have brought about: switched on, or put in.
    pub fn left_on(&self) -> Vec<Event> {
        InForce::after(&self.done).events().cloned().collect()
    }

    fn look(&mut self, now_us: u64) {
        self.looked_us = now_us;
        if let Err(reason) = self.pump(now_us) {
            self.failed.get_or_insert(reason);
        }
    }

    /// Hears the PLC, goes on, and tells it.
    fn pump(&mut self, now_us: u64) -> Result<(), String> {
        let port = |error: LinkError| format!("the PLC's port: {error}");
        let mut bytes = Vec::new();
        self.line.receive(&mut bytes).map_err(port)?;
        for byte in bytes {
            if let Some(fin) = self.ear.plc(byte) {
                self.heard_us = Some(now_us);
                self.nc.hear(now_us, fin);
            }
        }
        self.record(now_us, self.now.moves);
        let advanced = self.nc.advance(now_us).map_err(|missing| missing.to_string());
        self.tell(now_us).map_err(port)?;
        advanced?;
        match self.heard_us {
            Some(heard_us) if self.is_wired && now_us > heard_us + SILENT_US => {
                Err("the PLC has said nothing for a second: its line is cut, or it is off"
                    .to_owned())
            }
            _ => Ok(()),
        }
    }

    fn tell(&mut self, now_us: u64) -> Result<(), LinkError> {
        let signals = self.nc.signals();
        if self.told != Some(signals) || now_us >= self.told_us + AGAIN_US {
            self.line.send(&message::of_nc(&signals))?;
            (self.told, self.told_us) = (Some(signals), now_us);
        }
        self.record(now_us, self.now.moves);
        Ok(())
    }

    fn record(&mut self, now_us: u64, moves: bool) {
        let (nc, fin) = (self.nc.signals(), self.nc.fin());
        let sample = Sample { at_us: now_us, nc, fin, moves, ..self.now };
        if sample != (Sample { at_us: now_us, ..self.now }) {
            self.samples.push(sample);
        }
        self.now = sample;
    }
}

impl Hands for PlcRunner {
    fn begin(&mut self, event: &Event, _at_steps: &AxisMap<i64>) -> Result<(), String> {
        let now_us = self.line.now_us();
        self.record(now_us, false);
        self.now.line = event.line;
        self.begun += 1;
        self.event = Some(event.clone());
        self.waiting = functions(event.kind)?.into();
        // What was heard last may have been before a long motion.
        self.heard_us = self.heard_us.map(|_| now_us);
        if std::mem::take(&mut self.is_ahead) {
            self.waiting.pop_front();
            self.nc.motion_ends(now_us);
        }
        self.failed.take().map_or(Ok(()), Err)
    }

    fn is_done(&mut self) -> Result<bool, String> {
        loop {
            let now_us = self.line.now_us();
            self.pump(now_us)?;
            if self.nc.is_done() {
                let Some(function) = self.waiting.pop_front() else {
                    self.done.extend(self.event.take());
                    return Ok(true);
                };
                self.nc.begin(now_us, function, false);
                self.tell(now_us).map_err(|error| format!("the PLC's port: {error}"))?;
            }
            let next_us = self.nc.next_us().unwrap_or(now_us);
            if !self.line.pass(next_us) {
                return Ok(false);
            }
        }
    }

    fn stop(&mut self) {
        self.nc.stop();
        self.waiting.clear();
        let now_us = self.line.now_us();
        // A line that is gone has taken all levels back by itself.
        let _ = self.tell(now_us);
    }
}
