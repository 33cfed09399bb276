//! Many programs by one command: found in files and folders, judged on all cores, told in their
//! order, summed up. What of them is wrong comes out as text, JSON Lines, annotations of GitHub,
//! SARIF or JUnit's XML; the same words in each.

pub mod files;
mod github;
mod json;
pub mod judged;
mod junit;
pub mod pool;
mod sarif;
mod sum;
mod text;

use std::io::{self, BufWriter, ErrorKind, IntoInnerError, Seek, Write};
use std::num::NonZeroUsize;
use std::path::{Component, Path, PathBuf};

use anyhow::anyhow;
use clap::ValueEnum;
use cnc::base::source::temporary_file;

use self::files::Found;
use self::judged::Judged;
use self::sum::Sum;
use crate::args::Global;
use crate::exit::{Exit, Failure, Outcome, told};
use crate::meter::{self, Pass};
use crate::output;

/// How what is found is printed, and how it is found.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct ManyArgs {
    /// What is printed: for people, for GitHub's annotations, as SARIF 2.1.0 or as JUnit's XML
    #[arg(long, value_enum, default_value_t, value_name = "FORMAT")]
    pub format: Format,
    /// Where that goes, once all is there [default: standard output]
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
    /// How many programs are judged at a time [default: one a core]
    #[arg(short, long, value_name = "N", value_parser = jobs)]
    jobs: Option<NonZeroUsize>,
}

fn jobs(text: &str) -> Result<NonZeroUsize, String> {
    text.parse().map_err(|_| "a number from 1 on is expected".to_owned())
}

/// What is printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// A line a program, errors drawn on standard error
    #[default]
    Text,
    /// Commands of a GitHub workflow that mark lines (::error file=…)
    Github,
    /// SARIF 2.1.0, for code scanning
    Sarif,
    /// JUnit's XML, a test case a program
    Junit,
}

/// Which command judges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Judge {
    Interpret,
    Verify,
}

impl Judge {
    /// As it is typed.
    fn name(self) -> &'static str {
        match self {
            Judge::Interpret => "cnc interpret",
            Judge::Verify => "cnc verify",
        }
    }
}

/// How programs are told.
trait Form {
    /// Before the first; all their names are known.
    fn begin(&mut self, _out: &mut dyn Write, _names: &[&str]) -> io::Result<()> {
        Ok(())
    }
    /// One.
    fn program(&mut self, out: &mut dyn Write, judged: &Judged) -> io::Result<()>;
    /// After the last.
    fn end(&mut self, out: &mut dyn Write, sum: &Sum) -> io::Result<()>;
}

impl ManyArgs {
    /// Whether a program that is alone is told in full, as text or JSON, and not as one of many.
    pub fn in_full(&self, is_alone: bool, global: &Global) -> Result<bool, Failure> {
        let in_full = is_alone && self.format == Format::Text;
        if self.format != Format::Text && global.json {
            return Err(anyhow!("--json and --format are two forms of one output").into());
        }
        if in_full && self.output.is_some() {
            let reason =
                "--output takes what is told of many programs, or a --format; of one, use > OUT";
            return Err(anyhow!(reason).into());
        }
        Ok(in_full)
    }

    /// Judges all, tells of each in the order given, and sums up. The exit code is the worst of all.
    pub fn run<T: Sync>(
        &self,
        judge: Judge,
        tasks: &[T],
        name: impl Fn(&T) -> &Path,
        work: impl Fn(&T) -> Judged + Sync,
        global: &Global,
    ) -> Outcome {
        output::check_writable(&[self.output.as_deref()])?;
        let names: Vec<String> = tasks.iter().map(|task| judged::name(name(task))).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let mut sum = Sum::new();
        let tell = |out: &mut dyn Write| {
            let mut form = self.form(judge, global);
            form.begin(out, &names)?;
            let pass = Pass::of_many("judging programs");
            let threads = self.jobs.unwrap_or_else(pool::all_cores);
            pool::in_order(tasks, threads, work, |judged| {
                let judged = judged.unless_interrupted()?;
                sum.add(&judged);
                pass.many_at(sum.programs, tasks.len() as u64)?;
                say_notes(&judged, global);
                if let Some(failure) = &judged.trouble {
                    say!("error: {}", told(&failure.error));
                }
                form.program(out, &judged)?;
                Ok(out.flush()?)
            })?;
            form.end(out, &sum)?;
            Ok(out.flush()?)
        };
        match self.output.as_deref().filter(|path| *path != Path::new("-")) {
            Some(path) => spooled(path, tell)?,
            None => {
                meter::leave_terminal_to_results();
                tell(&mut WhileRead(BufWriter::new(io::stdout().lock())))?;
            }
        }
        if (self.is_for_programs(global) || self.output.is_some()) && !global.quiet {
            say!("{sum}");
        }
        Ok(match sum.code() {
            0 => Exit::Ok,
            1 => Exit::BadInput,
            _ => Exit::Unusable,
        })
    }

    fn is_for_programs(&self, global: &Global) -> bool {
        self.format != Format::Text || global.json
    }

    fn form<'a>(&self, judge: Judge, global: &'a Global) -> Box<dyn Form + 'a> {
        match self.format {
            Format::Text if global.json => Box::new(json::Lines::new(global)),
            Format::Text => Box::new(text::Lines::new(judge, global)),
            Format::Github => Box::new(github::Annotations),
            Format::Sarif => Box::new(sarif::Log::new(judge)),
            Format::Junit => Box::new(junit::Suite::new(judge)),
        }
    }
}

/// Says what in folders is not read: as the user may have meant it.
pub fn say_left_out(found: &Found, global: &Global) {
    if global.quiet {
        return;
    }
    for (path, reason) in &found.left_out {
        say!("note: {} is not read: {reason}", path.display());
    }
    if let Some(others) = found.others_by_ending() {
        say!("note: not read, for programs in folders end in {}: {others}", files::endings());
    }
    if global.verbose {
        found.others.iter().for_each(|path| say!("note: {} is not read", path.display()));
    }
}

/// Says what there is to say about a program's files.
pub fn say_notes(judged: &Judged, global: &Global) {
    if !global.quiet {
        judged.notes.iter().for_each(|note| say!("{note}"));
    }
}

/// A path as tools want it that know the working folder: below that where it can be, without `./`.
fn plain(path: &Path) -> PathBuf {
    let folder = std::env::current_dir().ok();
    let below = folder.and_then(|folder| path.strip_prefix(folder).ok());
    let parts = below.unwrap_or(path).components();
    parts.filter(|part| *part != Component::CurDir).collect()
}

/// Writes a file once all is there: what was read for it is known then and not written over, and who
/// stops the work before stops it at once.
fn spooled(
    path: &Path,
    tell: impl FnOnce(&mut dyn Write) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut spool = BufWriter::new(temporary_file()?);
    tell(&mut spool)?;
    let mut text = spool.into_inner().map_err(IntoInnerError::into_error)?;
    text.rewind()?;
    output::whole_file(path, |out| {
        io::copy(&mut text, out)?;
        Ok(())
    })
}

/// Writes as long as somebody reads; a verdict stands whether it is read to its end or not.
struct WhileRead<W: Write>(W);

impl<W: Write> Write for WhileRead<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        unless_closed(self.0.write(bytes), bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        unless_closed(self.0.flush(), ())
    }
}

fn unless_closed<T>(written: io::Result<T>, all: T) -> io::Result<T> {
    match written {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(all),
        written => written,
    }
}
