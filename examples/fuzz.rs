//! Tries programs that are made by changing those at hand at random, for so many seconds:
//! `cargo run --release --example fuzz -- --seconds 600 --seed 1`. What does not hold is written to
//! `fuzz/artifacts/`, and ends the run. So is, before it is tried, every program, into one file: where
//! a run hangs or runs out of memory, that file holds the reason. Without coverage to guide it, it
//! lives on good seeds: the samples, the corpus, and every code of the table.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Seek, Write};
use std::panic::{self, AssertUnwindSafe};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use cnc::gcode::codes;

#[path = "../fuzz/body.rs"]
mod body;

/// Longest program that is tried.
const BYTES_MAX: usize = 4096;

/// A program that takes longer than this does not hold.
const SLOW: Duration = Duration::from_secs(20);

/// Beside the codes: what else stands in programs.
const TOKENS: &str = "GR100 GR O100 N10 O100|sub O100|endsub O100|call|[1]|[2] O100|if|[#1|EQ|1] O100|else \
O100|elseif|[1] O100|endif O100|while|[#1|LT|3] O100|endwhile O100|do O100|repeat|[2] O100|endrepeat \
O100|break O100|continue O100|return|[2] o<a>|call o<a>|sub o<a>|endsub GOTO|10 IF|[#1|EQ|0]|GOTO|10 \
IF|[#1|EQ|0]|THEN|#1=2 WHILE|[#1|LT|5]|DO1 END1 #1=1 #1=#1+1 #<a>=2 #<_a>=3 X#1 Y[#1*2] Z-#<a> ##1=2 \
SIN[30] ATAN[1]/[2] EXISTS[#<a>] MOD ** #3000=1 #0 % / ; * (MSG,|a) (DEBUG,#1) (PRINT,#<a>) ( ) : , \
M98|P100|L2 G65|P100|A1|B2 M99 M30 M3|S1000 F100 F0.1 G41|D1 G42|D1 G40 G10|L2|P1|X1 G10|L1|P1|R1 \
G81|X1|Y1|Z-2|R1 G83|X1|Z-3|R1|Q1 G2|X1|Y1|R1 G3|X0|Y0|I1|J0 G51|X0|Y0|I1|J2|K1 G68|X0|Y0|R30 G16 \
G43|H1 G52|X1 G92|X0 G28|X0 G30 G53|G0 G20 G91 G90.1 G93 G95 G96|S100 G18 G19 T1|M6 G76|Z-1|R1|Q1 \
G87|Z-3|R1|I1|J1|K-1 X1 Y2 Z-1 I1 J-1 K1 R2 P2 Q1 L3 A90 U1 1e5 − \u{a0} 1,5 .5 -0 999999 1000000000 \
0.00001 123456789012345678901234567890";

/// A small generator of random numbers: splitmix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() % count.max(1) as u64) as usize
    }

    fn of<'a, T>(&mut self, list: &'a [T]) -> &'a T {
        &list[self.below(list.len())]
    }
}

/// The file that holds the program under trial.
struct Trial {
    path: PathBuf,
    file: File,
}

impl Trial {
    fn new() -> io::Result<Trial> {
        let folder = root().join("fuzz/artifacts");
        fs::create_dir_all(&folder)?;
        let path = folder.join(format!("trial-{}.nc", std::process::id()));
        let file = File::create(&path)?;
        Ok(Trial { path, file })
    }

    fn write(&mut self, program: &[u8]) -> io::Result<()> {
        self.file.set_len(0)?;
        self.file.rewind()?;
        self.file.write_all(program)
    }

    /// Keeps the program for what does not hold.
    fn keep(&self, why: &str) -> io::Result<()> {
        let path = self.path.with_file_name(format!("{why}-{}.nc", std::process::id()));
        fs::rename(&self.path, &path)?;
        say(&format!("{why}: {}", path.display()));
        Ok(())
    }
}

fn main() -> io::Result<ExitCode> {
    let number = |name: &str, default: u64| {
        let mut words = std::env::args().skip_while(|word| word != name).skip(1);
        words.next().and_then(|word| word.parse().ok()).unwrap_or(default)
    };
    let (seconds, seed) = (number("--seconds", 60), number("--seed", 1));
    let (seeds, tokens) = (seeds(), tokens());
    let mut random = Random(seed);
    let mut trial = Trial::new()?;
    let (begin, mut tried, mut slowest) = (Instant::now(), 0_u64, Duration::ZERO);
    while begin.elapsed() < Duration::from_secs(seconds) {
        let program = changed(&seeds, &tokens, &mut random);
        trial.write(&program)?;
        let started = Instant::now();
        if panic::catch_unwind(AssertUnwindSafe(|| body::program(&program))).is_err() {
            trial.keep("crash")?;
            return Ok(ExitCode::FAILURE);
        }
        tried += 1;
        slowest = slowest.max(started.elapsed());
        if started.elapsed() > SLOW {
            trial.keep("slow")?;
            return Ok(ExitCode::FAILURE);
        }
    }
    fs::remove_file(&trial.path)?;
    say(&format!("{tried} programs in {seconds} s, seed {seed}; the slowest took {slowest:?}"));
    Ok(ExitCode::SUCCESS)
}

fn say(text: &str) {
    // Nothing is lost with a standard output that is gone.
    let _ = writeln!(std::io::stdout(), "{text}");
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The samples and the corpus, as lines.
fn seeds() -> Vec<Vec<Vec<u8>>> {
    let folders =
        ["samples/good", "samples/bad", "samples/lathe", "samples/fanuc", "fuzz/corpus/program"];
    let entries = folders.iter().flat_map(|folder| fs::read_dir(root().join(folder)));
    let files: BTreeSet<PathBuf> = entries.flatten().flatten().map(|entry| entry.path()).collect();
    // A million calls, in every dialect: nothing else would be tried.
    let files =
        files.iter().filter(|file| file.file_stem().is_none_or(|name| name != "call-count"));
    let texts = files.filter_map(|file| fs::read(file).ok());
    let lines = |text: Vec<u8>| -> Vec<Vec<u8>> {
        let lines = text.split(|byte| *byte == b'\n').map(<[u8]>::to_vec);
        lines.take(200).collect()
    };
    texts.map(lines).collect()
}

fn tokens() -> Vec<String> {
    let words = TOKENS.split_ascii_whitespace().map(|token| token.replace('|', " "));
    words.chain(codes::CODES.iter().map(codes::Code::name)).collect()
}

/// A program, changed in a few places.
fn changed(seeds: &[Vec<Vec<u8>>], tokens: &[String], random: &mut Random) -> Vec<u8> {
    let mut lines = random.of(seeds).clone();
    for _ in 0..=random.below(8) {
        if lines.is_empty() {
            lines.push(Vec::new());
        }
        let at = random.below(lines.len());
        match random.below(10) {
            0 => drop(lines.remove(at)),
            1 => lines.insert(at, lines[random.below(lines.len())].clone()),
            2 => {
                let other = random.of(seeds);
                let from = random.below(other.len());
                let some = other.iter().skip(from).take(1 + random.below(6)).cloned();
                lines.splice(at..at, some);
            }
            3 => lines.insert(at, random.of(tokens).clone().into_bytes()),
            4 => {
                let within = random.below(lines[at].len() + 1);
                let bytes = bytes(random);
                lines[at].splice(within..within, bytes);
            }
            5 => {
                let within = random.below(lines[at].len());
                lines[at].truncate(within);
            }
            6 => number_changed(&mut lines[at], random),
            _ => {
                let token = random.of(tokens).clone() + " ";
                let places = lines[at].iter().enumerate().filter(|(_, byte)| **byte == b' ');
                let places: Vec<usize> = places.map(|(at, _)| at).chain([0]).collect();
                let within = *random.of(&places);
                lines[at].splice(within..within, token.into_bytes());
            }
        }
    }
    let mut program = lines.join(&b'\n');
    program.truncate(BYTES_MAX);
    program
}

/// A few bytes of any kind, or of one kind: of no text, of UTF-8 cut off, of digits without end.
fn bytes(random: &mut Random) -> Vec<u8> {
    let count = 1 + random.below(4);
    match random.below(4) {
        0 => (0..count).map(|_| random.next() as u8).collect(),
        1 => (0..count).map(|_| 0x80 | random.next() as u8).collect(),
        2 => vec![b"0123456789.-"[random.below(12)]; 1 << random.below(9)],
        _ => vec![b"\0\r\x1a\t\x7f\n()[]#%/;"[random.below(14)]; count],
    }
}

/// Another digit for one of a line's.
fn number_changed(line: &mut [u8], random: &mut Random) {
    let mut digits: Vec<&mut u8> = line.iter_mut().filter(|byte| byte.is_ascii_digit()).collect();
    let at = random.below(digits.len());
    if let Some(digit) = digits.get_mut(at) {
        **digit = b'0' + random.below(10) as u8;
    }
}
