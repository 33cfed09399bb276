//! Commands → the same with a question before each block of the program.
//!
//! Rule: every block is a node buffer of its own, or several, so that all nodes are idle while a person looks. A block is
//! what follows another line of the program: one that runs again right behind itself is not asked for again.
//! Motion has to be at rest between blocks, as it is planned with exact stops; a job refuses what is not.

use crate::base::{Command, Event, EventKind};

/// Puts an [`EventKind::NextBlock`] before each block.
pub fn single_blocks(commands: impl Iterator<Item = Command>) -> impl Iterator<Item = Command> {
    let (mut line, mut blocks, mut buffer) = (None, 0, None);
    commands.flat_map(move |command| {
        let of = match &command {
            Command::Tick(tick) => tick.line,
            Command::Event(event) => event.line,
        };
        let is_next = line.replace(of) != Some(of);
        let command = match command {
            Command::Tick(mut tick) => {
                let is_new = buffer.replace(tick.buffer) != Some(tick.buffer);
                blocks += u32::from(is_next || is_new);
                tick.buffer = blocks;
                Command::Tick(tick)
            }
            Command::Event(event) => {
                // What moves behind it is another stretch.
                buffer = buffer.filter(|_| !is_next);
                Command::Event(event)
            }
        };
        let question = Command::Event(Event { line: of, kind: EventKind::NextBlock });
        is_next.then_some(question).into_iter().chain([command])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{AxisMap, Tick};

    #[test]
    fn every_block_has_its_question_and_its_buffers() {
        let tick = |buffer, line| Command::Tick(Tick { buffer, line, counts: AxisMap::default() });
        let event = |line| Command::Event(Event { line, kind: EventKind::S(1.0) });
        let commands = [
            event(1),
            tick(0, 2),
            tick(0, 2),
            tick(0, 3),
            tick(1, 3),
            event(3),
            event(4),
            tick(1, 4),
            tick(1, 2),
        ];
        let told = single_blocks(commands.into_iter()).map(|command| match command {
            Command::Tick(tick) => format!("{}:{}", tick.line, tick.buffer),
            Command::Event(Event { line, kind: EventKind::NextBlock }) => format!("{line}?"),
            Command::Event(event) => format!("{}!", event.line),
        });
        let told: Vec<_> = told.collect();
        assert_eq!(told.join(" "), "1? 1! 2? 2:1 2:1 3? 3:2 3:3 3! 4? 4! 4:4 2? 2:5");
    }
}
