//! The person at the terminal, or nobody.

use std::io::{IsTerminal, stdin};

use anyhow::anyhow;
use cnc::base::{Axis, Event, EventKind, Machine, Progress};
use cnc::interp::Tools;
use cnc::wire::{End, Ending, Job, Master, MasterEvent};
use cnc::wire_io::{Hands, HookRunner, Operator};
use rustix::event::{PollFd, PollFlags, Timespec};

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
    /// What the tool table says, for whoever changes tools.
    tools: Tools,
    /// A command changes tools, and nobody has to be asked.
    changes_tools: bool,
    /// A line or the end of standard input is an interrupt too.
    stops_on_input: bool,
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
            tools: Tools::default(),
            changes_tools: false,
            stops_on_input: false,
        }
    }

    /// With the commands of the machine's profile for spindle, coolant and tools.
    pub fn with_hooks(self, machine: &Machine) -> Self {
        let changes_tools = machine.hooks.of(TOOL_CHANGE).is_some();
        Terminal { hands: Some(HookRunner::new(machine)), changes_tools, ..self }
    }

    /// With a tool table to name tools by.
    pub fn with_tools(self, tools: Tools) -> Self {
        Terminal { tools, ..self }
    }

    /// Refuses a job that would wait for a person who is not there.
    pub fn check_stops(&self, job: &Job) -> anyhow::Result<()> {
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

    /// Asks for a yes; without a terminal the answer is yes, and no once the system wants an end.
    pub fn asks(&self, question: &str) -> bool {
        if self.interrupts.by_system().is_some() {
            return false;
        }
        !self.can_ask || self.confirmed(&format!("{question} [Enter: yes, n: no]"))
    }

    /// Whether what the terminal is told is answered by Enter.
    fn confirmed(&self, text: &str) -> bool {
        self.bar.suspend(|| {
            say!("{text}");
            let answer = self.line();
            answer.is_some_and(|line| !line.trim_start().starts_with(['n', 'N', 'q', 'Q']))
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
    }

    /// Says a line unless the user wants errors only.
    pub fn say(&self, text: &str) {
        if !self.quiet {
            self.bar.say(text);
        }
    }

    /// A line from standard input; none at its end or when the operator interrupts.
    fn line(&self) -> Option<String> {
        let interrupts = self.interrupts.count();
        let wait = Timespec { tv_sec: 0, tv_nsec: 50_000_000 };
        loop {
            if has_input(wait) {
                let mut line = String::new();
                return (stdin().read_line(&mut line).ok()? > 0).then_some(line);
            }
            if self.interrupts.count() > interrupts {
                return None;
            }
        }
    }
}

impl Operator for Terminal {
    fn event(&mut self, event: &MasterEvent) {
        match event {
            MasterEvent::Event(event) | MasterEvent::Pause(event) | MasterEvent::Dwell(event) => {
                self.say(&format!("line {}: {}", event.line, event.kind));
            }
            MasterEvent::Filling { buffer, unit } if self.verbose => {
                self.say(&format!("buffer {buffer}: {unit} is filled"));
            }
            MasterEvent::Started { buffer } if self.verbose => {
                self.say(&format!("buffer {buffer}: started"));
            }
            MasterEvent::Homing { axis } => self.say(&format!("{axis} runs to its switch")),
            MasterEvent::Homed(run) => self.say(&direct::told(run)),
            MasterEvent::Jogging { axis } => self.say(&format!("{axis} jogs")),
            MasterEvent::Jogged { axis, steps } => {
                self.say(&format!("{axis} has stopped; by the clock it has made {steps} steps"));
            }
            MasterEvent::Held { line } => self.say(&format!("held before line {line}")),
            _ => {}
        }
    }

    fn hands(&mut self) -> Option<&mut dyn Hands> {
        self.hands.as_mut().map(|hands| hands as &mut dyn Hands)
    }

    fn pause(&mut self, event: &Event) -> bool {
        self.ignore_stops || !self.needs_person(event) || self.confirmed(&self.task(event))
    }

    fn progress(&mut self, master: &Master) {
        let progress = master.progress();
        self.bar.buffer(progress.buffer);
        self.bar.set(progress.ticks, progress.line);
    }

    fn interrupts(&mut self) -> usize {
        let count = self.interrupts.count();
        if self.stops_on_input && (count > 0 || has_input(Timespec::default())) {
            return count.max(1);
        }
        if count > self.told {
            self.told = count;
            let why = self.interrupts.by_system().map_or(String::new(), |why| format!("{why}: "));
            self.say(&if count == 1 {
                format!(
                    "{why}stopping where the axes are slow enough; a second Ctrl-C does not wait for \
                     that"
                )
            } else {
                format!("{why}stopping at once")
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
