//! A stretch of a program that is kept: parsed once, its loops and branches linked, so that it can
//! run as often as need be.

use std::collections::HashMap;
use std::rc::Rc;

use crate::gcode::{Block, Control, Fault, Label, Statement, Word, rules};

/// Text of a block that needs no more memory than others: a word of two bytes takes 24.
const BLOCK_BYTES: usize = 64;

/// Lines of a program, parsed.
#[derive(Debug)]
pub(super) struct Body {
    /// Which subprogram it is; none: a stretch of the main program.
    pub label: Option<Label>,
    /// Which file it stands in: 0 is the program's own.
    pub file: usize,
    /// The file's name, where it is not the program's own.
    pub file_name: Option<Rc<str>>,
    blocks: Vec<Stored>,
    text: Vec<u8>,
    /// Blocks that long lines count for beside themselves.
    surplus: usize,
    /// Where blocks with an N word stand.
    numbers: HashMap<u32, Vec<usize>>,
}

#[derive(Debug)]
struct Stored {
    line: u32,
    block: Block,
    text: (usize, usize),
    links: Links,
}

/// Where a statement leads, as places among the blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Links {
    /// Of a branch its next arm; of what stands in a loop or ends it, where the loop begins.
    pub other: usize,
    /// The end of the loop, branch or subprogram.
    pub end: usize,
}

impl Body {
    pub fn new(label: Option<Label>, file: usize, file_name: Option<Rc<str>>) -> Body {
        let (blocks, text, numbers) = (Vec::new(), Vec::new(), HashMap::new());
        Body { label, file, file_name, blocks, text, surplus: 0, numbers }
    }

    /// Adds a line.
    pub fn push(&mut self, line: u32, text: &[u8], block: &Block) {
        let begin = self.text.len();
        self.surplus += text.len() / BLOCK_BYTES;
        self.text.extend_from_slice(text);
        // Labels are written: what an expression makes of one is not known before it runs.
        let is_computed = |word: &Word| {
            block.values().iter().any(|(at, _)| block.words().get(usize::from(*at)) == Some(word))
        };
        if let Some(word) = block.word(b'N').filter(|word| !is_computed(word)) {
            self.numbers.entry(word.value as u32).or_default().push(self.blocks.len());
        }
        self.blocks.push(Stored {
            line,
            block: block.clone(),
            text: (begin, self.text.len()),
            links: Links::default(),
        });
    }

    /// A block, its line and that line's text.
    pub fn get(&self, at: usize) -> Option<(&Block, u32, &[u8])> {
        let stored = self.blocks.get(at)?;
        Some((&stored.block, stored.line, &self.text[stored.text.0..stored.text.1]))
    }

    pub fn len(&self) -> usize {
        self.blocks.len()
    }

    /// How many blocks it counts for, of what may be kept: long lines count for several.
    pub fn size(&self) -> usize {
        self.blocks.len() + self.surplus
    }

    pub fn links(&self, at: usize) -> Links {
        self.blocks.get(at).map_or(Links::default(), |stored| stored.links)
    }

    /// The first block of a line, or of the lines behind it.
    pub fn place_of(&self, line: u32) -> usize {
        self.blocks.partition_point(|stored| stored.line < line)
    }

    /// The block with an N word: the first behind a place, else the first of all.
    pub fn find(&self, number: u32, from: usize) -> Option<usize> {
        let places = self.numbers.get(&number)?;
        places.iter().find(|place| **place >= from).or(places.first()).copied()
    }

    fn link(&mut self, at: usize, change: impl FnOnce(&mut Links)) {
        if let Some(stored) = self.blocks.get_mut(at) {
            change(&mut stored.links);
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Sub,
    If,
    While,
    Do,
    Repeat,
    WhileDo,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Kind::Sub => "sub",
            Kind::If => "if",
            Kind::While => "while",
            Kind::Do => "do",
            Kind::Repeat => "repeat",
            Kind::WhileDo => "DO",
        }
    }

    fn is_loop(self) -> bool {
        !matches!(self, Kind::Sub | Kind::If)
    }
}

/// What has begun and not ended.
#[derive(Debug)]
struct Open {
    kind: Kind,
    label: Label,
    at: usize,
    line: u32,
    start: u32,
    end: u32,
    /// Arms of a branch; what leaves a loop or goes on with it.
    inside: Vec<usize>,
}

/// Links statements as they are added to a body.
#[derive(Debug, Default)]
pub(super) struct Linker {
    open: Vec<Open>,
}

impl Linker {
    /// Whether all that has begun has ended.
    pub fn is_closed(&self) -> bool {
        self.open.is_empty()
    }

    /// Links the statement of the block added last.
    pub fn add(&mut self, body: &mut Body, statement: &Statement) -> Result<(), Fault> {
        let at = body.len().saturating_sub(1);
        match &statement.control {
            Control::Sub => self.begin(Kind::Sub, body, statement),
            Control::If(_) => self.begin(Kind::If, body, statement),
            Control::Do => self.begin(Kind::Do, body, statement),
            Control::Repeat(_) => self.begin(Kind::Repeat, body, statement),
            Control::WhileDo(_) => self.begin(Kind::WhileDo, body, statement),
            Control::While(_) if self.ends_do(&statement.label) => {
                return self.finish(Kind::Do, body, statement);
            }
            Control::While(_) => self.begin(Kind::While, body, statement),
            Control::EndSub(_) => return self.finish(Kind::Sub, body, statement),
            Control::EndIf => return self.finish(Kind::If, body, statement),
            Control::EndWhile => return self.finish(Kind::While, body, statement),
            Control::EndRepeat => return self.finish(Kind::Repeat, body, statement),
            Control::EndDo => return self.finish(Kind::WhileDo, body, statement),
            Control::ElseIf(_) | Control::Else => {
                let branch = self.open.last_mut();
                let Some(branch) =
                    branch.filter(|open| open.kind == Kind::If && open.label == statement.label)
                else {
                    return Err(unmatched(statement, "there is no if before this"));
                };
                let arm = branch.inside.last().copied().unwrap_or(branch.at);
                body.link(arm, |links| links.other = at);
                branch.inside.push(at);
            }
            Control::Break | Control::Continue => {
                let mut around = self.open.iter_mut().rev();
                let around =
                    around.find(|open| open.kind.is_loop() && open.label == statement.label);
                let Some(around) = around else {
                    return Err(unmatched(statement, "this stands in no loop of its label"));
                };
                body.link(at, |links| links.other = around.at);
                around.inside.push(at);
            }
            Control::Title
            | Control::Return(_)
            | Control::Call(_)
            | Control::CallNumber(..)
            | Control::Goto { .. }
            | Control::Then(_) => {}
        }
        Ok(())
    }

    fn ends_do(&self, label: &Label) -> bool {
        self.open.last().is_some_and(|open| open.kind == Kind::Do && open.label == *label)
    }

    fn begin(&mut self, kind: Kind, body: &Body, statement: &Statement) {
        let at = body.len().saturating_sub(1);
        let line = body.get(at).map_or(0, |(_, line, _)| line);
        let Statement { label, start, end, .. } = statement.clone();
        self.open.push(Open { kind, label, at, line, start, end, inside: Vec::new() });
    }

    fn finish(&mut self, kind: Kind, body: &mut Body, statement: &Statement) -> Result<(), Fault> {
        let end = body.len().saturating_sub(1);
        let open = match self.open.pop() {
            Some(open) if open.kind == kind && open.label == statement.label => open,
            Some(open) => {
                let message =
                    format!("the {} on line {} has not ended yet", open.kind.name(), open.line);
                self.open.push(open);
                return Err(unmatched(statement, message));
            }
            None => {
                return Err(unmatched(
                    statement,
                    format!("there is no {} before this", kind.name()),
                ));
            }
        };
        body.link(end, |links| *links = Links { other: open.at, end });
        body.link(open.at, |links| links.end = end);
        let last_arm = open.inside.last().copied().unwrap_or(open.at);
        for inside in open.inside {
            body.link(inside, |links| links.end = end);
        }
        if kind == Kind::If {
            body.link(last_arm, |links| links.other = end);
        }
        Ok(())
    }

    /// What is wrong at the end of the text: the line and the fault of what was begun last.
    pub fn unfinished(&self) -> Option<(u32, Fault)> {
        let open = self.open.last()?;
        let message = format!("this {} has no end", open.kind.name());
        let fault = Fault::new(&rules::UNMATCHED_FLOW, open.start, open.end, message);
        let help = match open.kind {
            Kind::Do => format!("end it by {} while [condition]", open.label),
            Kind::WhileDo => "end it by END and its number".to_owned(),
            kind => format!("end it by {} end{}", open.label, kind.name()),
        };
        Some((open.line, fault.help(help)))
    }
}

/// A statement without what it belongs to.
pub(super) fn unmatched(statement: &Statement, message: impl std::fmt::Display) -> Fault {
    Fault::new(&rules::UNMATCHED_FLOW, statement.start, statement.end, message)
}
