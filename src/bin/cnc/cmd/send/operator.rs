//! The person at the terminal, or nobody.

use std::io::{IsTerminal, stdin};
use std::sync::Arc;

use anyhow::anyhow;
use cnc::base::{Axis, Event, EventKind, Machine, Source};
use cnc::interp::Tools;
use cnc::wire::{End, Ending, Job, Live, Master, MasterEvent};
use cnc::wire_io::{Hands, HookRunner, Operator, PlcRunner};
use rustix::event::{PollFd, PollFlags, Timespec};

use super::live::{self, Listing};
use super::{Bar, direct};
use crate::args::Global;
use crate::interrupt::Interrupts;

/// M6, with whatever tool.
const TOOL_CHANGE: EventKind = EventKind::M { code: 6, spindle_rpm: None, tool: None };

/// Tells and asks on a terminal; asks nothing where there is none.
pub struct Terminal {
    pub bar: Bar,
    ignore_stops: bool,
    can_ask: bool,
    quiet: bool,
    verbose: bool,
    interrupts: Interrupts,
    /// Interrupts that have been answered.
    told: usize,
    hands: Option<HookRunner>,
    plc: Option<PlcRunner>,
    /// What the tool table says, for whoever changes tools.
    tools: Tools,
    /// A command or a PLC changes tools, and nobody has to be asked.
    changes_tools: bool,
    /// No block is asked for any more.
    runs_on: bool,
    /// One of them asked for a hold that has not come about yet.
    holding: bool,
    /// A line or the end of standard input is an interrupt too.
    stops_on_input: bool,
    live: Option<Live>,
    listing: Option<Arc<Listing>>,
}

impl Terminal {
    pub fn new(ignore_stops: bool, global: &Global, interrupts: Interrupts) -> Self {
        Terminal {
            bar: Bar::new(global.quiet),
            ignore_stops,
            can_ask: !global.no_input && stdin().is_terminal(),
            quiet: global.quiet,
            verbose: global.verbose,
            interrupts,
            told: 0,
            hands: None,
            plc: None,
            tools: Tools::default(),
            changes_tools: false,
            runs_on: false,
            holding: false,
            stops_on_input: false,
            live: None,
            listing: None,
        }
    }

    /// With the commands of the machine's profile for spindle, coolant and tools.
    pub fn with_hooks(self, machine: &Machine) -> Self {
        let changes_tools = machine.hooks.of(TOOL_CHANGE).is_some();
        Terminal { hands: Some(HookRunner::new(machine)), changes_tools, ..self }
    }

    /// With a PLC that does all of that.
    pub fn with_plc(self, plc: PlcRunner) -> Self {
        Terminal { plc: Some(plc), ..self }
    }

    /// A PLC changes tools, and nobody has to be asked.
    pub fn leaving_tools_to_plc(self) -> Self {
        Terminal { changes_tools: true, ..self }
    }

    /// The PLC, once the job is over: nothing is asked of it any more.
    pub fn end_plc(&mut self) -> Option<&PlcRunner> {
        let plc = self.plc.as_mut()?;
        plc.stop();
        Some(plc)
    }

    /// With a tool table to name tools by.
    pub fn with_tools(self, tools: Tools) -> Self {
        Terminal { tools, ..self }
    }

    /// Refuses a job that would wait for a person who is not there.
    pub fn check_stops(&self, job: &Job) -> anyhow::Result<()> {
        let mut events = job.events();
        if !self.can_ask && events.any(|event| event.kind == EventKind::NextBlock) {
            return Err(anyhow!(
                "--single-block asks before each block, and there is nobody to ask"
            ));
        }
        let stop = job.events().find(|event| self.needs_person(event));
        match stop {
            Some(stop) if !self.ignore_stops && !self.can_ask => Err(anyhow!(
                "line {}: {} waits for a person, and there is nobody to ask; --ignore-stops goes on",
                stop.line,
                stop.kind
            )),
            _ => Ok(()),
        }
    }

    /// From here on a line or the end of standard input stops what runs.
    pub fn stop_on_input(&mut self) {
        self.stops_on_input = true;
    }

    /// Whether there is somebody to ask.
    pub fn can_ask(&self) -> bool {
        self.can_ask
    }

    /// Shows a job while it runs, with the lines of the program that it was made from.
    pub fn watch(&mut self, job: &Job, machine: &Machine) {
        self.live = (job.ticks > 0).then(|| Live::new(job, machine));
        if let Some(plc) = &mut self.plc {
            plc.begin_job(job);
        }
    }

    /// The program whose lines are shown.
    pub fn list(&mut self, source: Source) -> std::io::Result<()> {
        self.listing = Some(Arc::new(Listing::new(source)?));
        Ok(())
    }

    /// Asks for a yes; without a terminal the answer is yes, and no once the system wants an end.
    pub fn asks(&self, question: &str) -> bool {
        if self.interrupts.by_system().is_some() {
            return false;
        }
        !self.can_ask || self.confirmed(&format!("{question} [Enter: yes, n: no]"))
    }

    /// Whether what the terminal is told is answered by Enter, or a yes. All else is a no: words that are
    /// typed where a machine is about to move mean that it should not.
    fn confirmed(&self, text: &str) -> bool {
        self.bar.suspend(|| {
            say!("{text}");
            let answer = self.line();
            answer.is_some_and(|line| is_yes(&line))
        })
    }

    /// A tool change that a command makes needs nobody; all else that waits for a person does.
    fn needs_person(&self, event: &Event) -> bool {
        let is_change = matches!(event.kind, EventKind::M { code: 6, .. });
        event.kind.waits_for_person() && !(is_change && self.changes_tools)
    }

    /// What a person has to do about an event.
    fn task(&self, event: &Event) -> String {
        match event.kind {
            EventKind::M { code: 6, tool: Some(tool), .. } => {
                format!(
                    "put in tool {}; all nodes are idle. Press Enter when it is in [n: stop]",
                    self.tool(tool)
                )
            }
            EventKind::M { code: 6, .. } => {
                "change the tool; all nodes are idle. Press Enter when it is in [n: stop]"
                    .to_owned()
            }
            _ => "all nodes are idle. Press Enter to go on [n: stop]".to_owned(),
        }
    }

    /// A tool's number, and what the table says of it.
    fn tool(&self, number: u32) -> String {
        let mut words = vec![number.to_string()];
        words.extend(self.tools.name(number).map(str::to_owned));
        if let Some(tool) = self.tools.get(number) {
            let offsets = Axis::ALL.into_iter().filter(|axis| tool.offset_mm[*axis] != 0.0);
            words.extend(offsets.map(|axis| format!("{axis} offset {} mm", tool.offset_mm[axis])));
            if tool.diameter_mm != 0.0 {
                words.push(format!("diameter {} mm", tool.diameter_mm));
            }
        }
        words.join(", ")
    }

    /// Says what commands may have left on when a job has not come to its end.
    pub fn say_left_on(&self, ending: &Ending) {
        if ending.end == End::Done {
            return;
        }
        for event in self.hands.iter().flat_map(HookRunner::left_on) {
            say!("may still be on: {} of line {}, whose hook has run", event.kind, event.line);
        }
        for event in self.plc.iter().flat_map(PlcRunner::left_on) {
            say!("may still be on: {} of line {}, which the PLC has done", event.kind, event.line);
        }
    }

    /// Says a line unless the user wants errors only.
    pub fn say(&self, text: &str) {
        if !self.quiet {
            self.bar.say(text);
        }
    }

    /// Shows a block that comes next, and asks whether to run it. What was typed before is no answer.
    fn next_block(&mut self, line: u32) -> bool {
        if self.runs_on {
            return true;
        }
        if self.interrupts.by_system().is_some() {
            return false;
        }
        let _ = rustix::termios::tcflush(stdin(), rustix::termios::QueueSelector::IFlush);
        let text = self.listing.as_ref().map_or(String::new(), |listing| listing.line(line));
        let answer = self.bar.suspend(|| {
            say!("next      line {line}: {text}");
            say!("[Enter: run it, a: run all that is left, s: stop here]");
            self.line()
        });
        let answer = answer.map(|line| line.trim().to_lowercase());
        self.runs_on = answer.as_deref() == Some("a");
        matches!(answer.as_deref(), Some("" | "y" | "a"))
    }

    /// Asks whether a job that is held goes on. What was typed before is no answer; no answer, or a
    /// wish of the system to end, is no.
    fn goes_on(&self) -> bool {
        if !self.can_ask || self.interrupts.by_system().is_some() {
            return false;
        }
        // What cannot be thrown away is read as an answer, and asked again.
        let _ = rustix::termios::tcflush(stdin(), rustix::termios::QueueSelector::IFlush);
        self.bar.suspend(|| {
            loop {
                say!("[g: go on, s: stop here]");
                let answer = self.line().unwrap_or_else(|| "s".to_owned());
                match answer.trim().to_lowercase().as_str() {
                    "g" | "go" | "go on" => return true,
                    "s" | "stop" | "q" => return false,
                    _ => {}
                }
            }
        })
    }

    /// A line from standard input; none at its end or when the operator interrupts. Read byte by
    /// byte: what follows belongs to the next question.
    fn line(&self) -> Option<String> {
        let interrupts = self.interrupts.count();
        let wait = Timespec { tv_sec: 0, tv_nsec: 50_000_000 };
        let (input, mut line) = (stdin(), Vec::new());
        loop {
            if has_input(wait) {
                let mut byte = [0];
                match rustix::io::read(&input, &mut byte) {
                    Ok(0) | Err(_) => return None,
                    Ok(_) if byte == *b"\n" => break,
                    Ok(_) => line.extend(byte),
                }
            }
            if self.interrupts.count() > interrupts {
                return None;
            }
        }
        Some(String::from_utf8_lossy(&line).into_owned())
    }
}

impl Operator for Terminal {
    fn event(&mut self, event: &MasterEvent) {
        if let Some(live) = &mut self.live {
            live.event(event);
        }
        match event {
            MasterEvent::Pause(event) if event.kind == EventKind::NextBlock => {}
            MasterEvent::Event(event) | MasterEvent::Pause(event) | MasterEvent::Dwell(event) => {
                self.say(&format!("line {}: {}", event.line, event.kind));
            }
            MasterEvent::Filling { buffer, unit, .. } if self.verbose => {
                self.say(&format!("buffer {buffer}: {unit} is filled"));
            }
            MasterEvent::Started { buffer } if self.verbose => {
                self.say(&format!("buffer {buffer}: started"));
            }
            MasterEvent::Homing { axis } => {
                self.say(&format!("{axis} runs to its switch; nothing sent can stop it"));
            }
            MasterEvent::Homed(run) => self.say(&direct::told(run)),
            MasterEvent::Jogging { axis } => self.say(&format!("{axis} jogs")),
            MasterEvent::Jogged { axis, steps } => {
                self.say(&format!("{axis} has stopped; by the clock it has made {steps} steps"));
            }
            _ => {}
        }
    }

    fn hands(&mut self) -> Option<&mut dyn Hands> {
        match &mut self.plc {
            Some(plc) => Some(plc),
            None => self.hands.as_mut().map(|hands| hands as &mut dyn Hands),
        }
    }

    fn pause(&mut self, event: &Event) -> bool {
        if event.kind == EventKind::NextBlock {
            return self.next_block(event.line);
        }
        self.ignore_stops || !self.needs_person(event) || self.confirmed(&self.task(event))
    }

    fn held(&mut self, master: &Master) -> bool {
        let (progress, axes) = (master.progress(), master.axes());
        let counted = axes.iter().filter(|end| end.counted);
        let axes = counted.map(|end| format!("{} {:.3}", end.axis, end.position_mm));
        let axes = axes.collect::<Vec<_>>().join(", ");
        let (ticks, all) = (progress.ticks, master.job().ticks);
        let line = progress.line;
        self.say(&match self.live {
            Some(_) => format!("held after tick {ticks} of {all}, line {line}, at {axes}"),
            None => "held; no axis runs".to_owned(),
        });
        let goes_on = self.goes_on();
        self.holding = false;
        self.told = self.interrupts.count();
        goes_on
    }

    fn progress(&mut self, master: &Master) {
        if let Some(plc) = &mut self.plc {
            let progress = master.progress();
            plc.progress(progress.ticks, progress.at_us);
        }
        let Some(live) = &mut self.live else { return };
        live.update(master);
        if self.bar.is_due() {
            let (reading, listing) = (live.reading(master), self.listing.clone());
            self.bar.show(move || live::shown(&reading, listing.as_deref()));
        }
    }

    fn interrupts(&mut self) -> usize {
        let count = self.interrupts.count();
        if self.stops_on_input && (count > 0 || has_input(Timespec::default())) {
            return count.max(1);
        }
        if count > self.told {
            let more = count > self.told + 1 || self.holding;
            (self.told, self.holding) = (count, true);
            let why = self.interrupts.by_system().map_or(String::new(), |why| format!("{why}: "));
            let where_to = match self.live {
                Some(_) => "where the axes are slow enough",
                None => "when the axis under way is at its switch",
            };
            self.say(&if more {
                format!("{why}stopping at once")
            } else {
                format!("{why}stopping {where_to}; a second Ctrl-C does not wait for that")
            });
        }
        count
    }
}

/// Whether standard input has something, or its end, within this time.
fn has_input(wait: Timespec) -> bool {
    let input = stdin();
    let mut polled = [PollFd::new(&input, PollFlags::IN)];
    rustix::event::poll(&mut polled, Some(&wait)).is_ok_and(|ready| ready > 0)
}

/// Enter, `y` or `yes`.
fn is_yes(answer: &str) -> bool {
    matches!(answer.trim().to_ascii_lowercase().as_str(), "" | "y" | "yes")
}

#[cfg(test)]
mod tests {
    use super::is_yes;

    #[test]
    fn all_but_a_yes_is_a_no() {
        assert!(["", "\n", "y", " Yes\r\n"].into_iter().all(is_yes));
        assert!(!["n", "q", "stop", "x", "\u{1b}", "cargo test"].into_iter().any(is_yes));
    }
}
