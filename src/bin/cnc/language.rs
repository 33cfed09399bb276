//! Options that say how a program is read: `interpret`, `interpolate`, `verify` and `send` share
//! them.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use clap::builder::PossibleValue;
use cnc::interp::{self, Dialect};

/// How a program is read.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct LanguageArgs {
    /// Whose meaning is taken where the same text means different things on different controls
    #[arg(
        long,
        value_enum,
        env = "CNC_DIALECT",
        hide_env = true,
        default_value_t,
        value_name = "NAME"
    )]
    pub dialect: DialectArg,
    /// Leave out lines that begin with /
    #[arg(long)]
    pub block_delete: bool,
    /// Leave out words of other controls that mean nothing here: E words and temperatures of
    /// printers, $ lines of senders
    #[arg(long)]
    pub lenient: bool,
    #[command(flatten)]
    pub subprograms: SubprogramArgs,
}

/// Where subprograms may lie, and how much may run; what a program means does not hang on them.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct SubprogramArgs {
    /// A further folder below which subprograms may lie in files of their own [always: the
    /// program's folder; of standard input the working directory]
    #[arg(long, value_name = "DIR")]
    pub include: Vec<PathBuf>,
    /// Most passes of all loops together [default: 10000000]
    #[arg(long, value_name = "N")]
    pub max_passes: Option<u64>,
}

/// A dialect, as an option.
#[derive(Clone, Copy, Debug, Default)]
pub struct DialectArg(pub Dialect);

impl ValueEnum for DialectArg {
    fn value_variants<'a>() -> &'a [DialectArg] {
        const ALL: [DialectArg; 6] = [
            DialectArg(Dialect::Iso),
            DialectArg(Dialect::LinuxCnc),
            DialectArg(Dialect::Fanuc),
            DialectArg(Dialect::FanucLathe),
            DialectArg(Dialect::FanucLatheB),
            DialectArg(Dialect::Grbl),
        ];
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.0.name()))
    }
}

impl LanguageArgs {
    /// The options of a run of the program in a file.
    pub fn options(&self, file: &Path) -> interp::Options {
        // Standard input, as a bare name, is of the working directory.
        let own = match file.parent() {
            Some(folder) if folder != Path::new("") => folder.to_owned(),
            _ => PathBuf::from("."),
        };
        interp::Options {
            dialect: self.dialect.0,
            block_delete: self.block_delete,
            lenient: self.lenient,
            folders: [own].into_iter().chain(self.subprograms.include.iter().cloned()).collect(),
            max_passes: self.subprograms.max_passes,
            ..Default::default()
        }
    }
}
