//! The command dump: what is written is read back, and nothing that was changed passes.

use cnc::base::{Axis, AxisMap, Command, Event, EventKind, Machine, Source, Tick};
use cnc::tape::{Encoding, Header, Origin, Reader, TapeError, Writer, looks_like_dump};
use proptest::prelude::*;

fn header(encoding: Encoding) -> Header {
    let mut start_steps = AxisMap::default();
    [start_steps[Axis::X], start_steps[Axis::Y], start_steps[Axis::Z]] = [7500, 5000, 5000];
    Header {
        tool: "cnc 0.1.0".to_owned(),
        program: Origin { name: "a, b sha256: c.nc".to_owned(), sha256: [0xa1; 32] },
        inputs: ["x, y.nc", "z"].map(|n| Origin { name: n.to_owned(), sha256: [7; 32] }).into(),
        options: vec![("dialect".to_owned(), "iso".to_owned())],
        machine: Origin { name: "starmill".to_owned(), sha256: [2; 32] },
        tick_us: 11000,
        steps_per_mm: Axis::LINEAR.map(|axis| (axis, 100.0)).into(),
        start_steps,
        encoding,
    }
}

fn tick(buffer: u32, line: u32, x: i32, y: i32, z: i32) -> Command {
    let mut counts = AxisMap::default();
    [counts[Axis::X], counts[Axis::Y], counts[Axis::Z]] = [x, y, z];
    Command::Tick(Tick { buffer, line, counts })
}

fn event(line: u32, text: &str) -> Command {
    Command::Event(Event { line, kind: text.parse::<EventKind>().expect("an event") })
}

fn job() -> Vec<Command> {
    vec![
        event(3, "M3 S1200"),
        event(3, "G4 P0.5"),
        tick(0, 3, 5, -3, 0),
        tick(0, 3, 0, 0, 0),
        tick(0, 4, 119, -119, 7),
        event(5, "T2"),
        tick(1, 5, 0, 0, 0),
        tick(1, 5, 1, 0, -1),
        event(7, "M5"),
        event(7, "M30"),
    ]
}

fn write(header: &Header, job: &[Command]) -> String {
    let mut writer = Writer::new(Vec::new(), header).expect("a header");
    job.iter().for_each(|command| writer.command(command).expect("a row"));
    String::from_utf8(writer.finish().expect("the end")).expect("text")
}

fn read(text: &str) -> Result<Vec<Command>, TapeError> {
    Reader::open(Source::memory("dump", text.as_bytes()))?.collect()
}

/// A dump with `from` replaced by `to` once must be refused with a message that holds `reason`.
fn check_refused(from: &str, to: &str, reason: &str) {
    let good = write(&header(Encoding::Counts), &job());
    assert!(good.contains(from), "{from} is not in\n{good}");
    let bad = good.replacen(from, to, 1);
    let error = read(&bad).expect_err(&format!("{from} -> {to} must be refused")).to_string();
    assert!(error.contains(reason), "{from} -> {to}: {error}");
}

#[test]
fn a_dump_is_what_the_contract_shows() {
    insta::assert_snapshot!(write(&header(Encoding::Counts), &job()));
}

#[test]
fn a_header_without_end_is_refused() {
    let text = "# cnc-dump: 1\n".to_owned() + &"#\n".repeat(100_000);
    let error = read(&text).expect_err("no header").to_string();
    assert!(error.contains("more than 1000 lines"), "{error}");
}

#[test]
fn a_converted_dump_is_named_so() {
    let text = write(&header(Encoding::Counts), &job()).replace('\n', "\r\n");
    let error = read(&text).expect_err("CR LF").to_string();
    assert!(error.contains("CR LF"), "{error}");
}

/// A quote must not swallow the lines after it: the row that has it is named.
#[test]
fn a_quote_is_no_part_of_a_row() {
    check_refused("1,0,3,0,0,0,", "1,0,3,\"0,0,0,", "line 13 of the dump: '\"0'");
}

#[test]
fn what_is_written_is_read_back() {
    for encoding in [Encoding::Counts, Encoding::Bytes] {
        let text = write(&header(encoding), &job());
        assert!(looks_like_dump(text.as_bytes()));
        assert_eq!(read(&text).expect("a dump"), job());
        let reader = Reader::open(Source::memory("dump", text.as_bytes())).expect("a dump");
        assert_eq!(*reader.header(), header(encoding));
    }
    assert!(!looks_like_dump(b"%\nO0001\n"));
}

#[test]
fn a_dump_without_motion_is_read_back() {
    for job in [vec![], vec![event(1, "M30")], vec![event(1, "M3 S1"), tick(0, 1, 0, 0, 0)]] {
        assert_eq!(read(&write(&header(Encoding::Counts), &job)).expect("a dump"), job);
    }
}

#[test]
fn a_trailing_tick_of_zeros_is_told_from_trailing_events() {
    let job = [tick(0, 1, 1, 0, 0), event(2, "M0"), tick(0, 2, 0, 0, 0)];
    assert_eq!(read(&write(&header(Encoding::Counts), &job)).expect("a dump"), job);
    let text = write(&header(Encoding::Counts), &job[..2]);
    assert!(text.contains("# end: ticks=1 ") && text.contains("\n1,0,2,0,0,0,M0\n"), "{text}");
    assert_eq!(read(&text).expect("a dump"), job[..2]);
}

#[test]
fn changes_are_refused_each_with_its_reason() {
    check_refused("5,-3", "6,-3", "hash");
    check_refused("1,0,3,0,0,0,\n", "", "tick 2 where 1 belongs");
    check_refused("\n# end", "\n# emd", "1 fields where 7");
    check_refused("ticks=5", "ticks=4", "5 ticks where 4");
    check_refused(" X=7625", " X=7624", "end at X=7625");
    check_refused("0,4,119", "2,4,119", "buffer 2 after buffer 0");
    check_refused("0,3,5,-3,0", "0,3,5,-3", "6 fields where 7");
    check_refused("119", "1 19", "no value of a count");
    check_refused("M5; ", "Q5; ", "no event");
    check_refused("cnc-dump: 1", "cnc-dump: 2", "version 2");
    check_refused("# cnc-dump", "# dump", "no command dump");
    check_refused("# tick_us: 11000\n", "", "no line '# tick_us");
    check_refused("# tick_us: 11000", "# tick_us: 0", "line 7: '0' is no value");
    check_refused("# encoding", "# color: red\n# encoding", "'color' is unknown");
    check_refused("tick,buffer", "tick,bufer", "columns are not");
}

#[test]
fn every_truncation_is_refused() {
    let good = write(&header(Encoding::Counts), &job());
    // Without the last line end nothing is lost.
    for length in 0..good.len() - 1 {
        let error = read(&good[..length]).expect_err("must be refused").to_string();
        let told =
            ["truncated", "no command dump", "header of the dump", "columns", "hash", "version"];
        assert!(told.iter().any(|reason| error.contains(reason)), "{length}: {error}");
    }
    read(&good[..good.len() - 1]).expect("complete");
    let error = read(&(good + "\n")).expect_err("must be refused").to_string();
    assert!(error.contains("more text"), "{error}");
}

#[test]
fn what_cannot_be_written_is_refused() {
    let check = |header: Header, command: Command| {
        let writer = Writer::new(Vec::new(), &header);
        assert!(writer.and_then(|mut writer| writer.command(&command)).is_err());
    };
    check(header(Encoding::Bytes), tick(0, 1, 128, 0, 0));
    let mut counts = AxisMap::default();
    counts[Axis::A] = -1;
    check(header(Encoding::Counts), Command::Tick(Tick { counts, ..Tick::default() }));
    let options = vec![("a b".to_owned(), String::new())];
    check(Header { options, ..header(Encoding::Counts) }, tick(0, 1, 0, 0, 0));
}

#[test]
fn an_unsealed_dump_needs_axis_columns_only() {
    let machine = Machine::load("starmill").expect("built in");
    let open = |text: &str| Reader::open_unsealed(Source::memory("d", text.as_bytes()), &machine);
    let reader = open("# by hand\nY,\"X\",time\n1,2,0.1\n# note\n-3,4,0.2\n").expect("a dump");
    assert_eq!(reader.unused_columns(), ["time"]);
    assert_eq!(reader.header().start_steps[Axis::X], 7500);
    let job: Vec<Command> = reader.collect::<Result<_, _>>().expect("rows");
    assert_eq!(job, [tick(0, 0, 2, 1, 0), tick(0, 0, 4, -3, 0)]);
    let sealed = write(&header(Encoding::Bytes), &job).replace("# end", "# ende");
    let again: Vec<Command> =
        open(&sealed).expect("a dump").collect::<Result<_, _>>().expect("rows");
    assert_eq!(again, job);
    for (text, reason) in [
        ("", "no column of an axis"),
        ("a,b\n1,2\n", "no column of an axis"),
        ("X,X\n1,2\n", "'X' is there twice"),
        ("X,Y,Z\n1,2\n", "line 2"),
        ("# c\nX\n# c\n1.5\n", "line 4"),
    ] {
        let rows = open(text).and_then(|reader| reader.collect::<Result<Vec<_>, _>>());
        let error = rows.expect_err(text).to_string();
        assert!(error.contains(reason), "{text}: {error}");
    }
}

proptest! {
    #[test]
    fn any_job_is_read_back(
        rows in prop::collection::vec((0u32..2, 0u32..100_000, any::<[i32; 3]>(), 0usize..4), 0..40)
    ) {
        let mut job = Vec::new();
        let mut buffer = 0;
        for (index, (step, line, [x, y, z], events)) in rows.into_iter().enumerate() {
            buffer += if index > 0 { step } else { 0 };
            (0..events % 3).for_each(|_| job.push(event(line, "M6 T2")));
            job.push(tick(buffer, line, x, y, z));
        }
        prop_assert_eq!(read(&write(&header(Encoding::Counts), &job)).expect("a dump"), job);
    }

    #[test]
    fn no_text_trips_the_reader(text in "(# cnc-dump: 1\n)?[#a-zX,0-9:= \n\"-]{0,200}") {
        let machine = Machine::load("starmill").expect("built in");
        let source = Source::memory("dump", text.as_bytes());
        let _ = Reader::open(source.clone()).map(Iterator::count);
        let _ = Reader::open_unsealed(source, &machine).map(Iterator::count);
    }
}
