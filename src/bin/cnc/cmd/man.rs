//! `cnc man`: manual pages, made from the same text as `--help`.

use std::io::{self, Write};
use std::path::PathBuf;

use anyhow::Context;
use clap::CommandFactory;
use clap_mangen::Man;

use crate::args::Args as CommandLine;
use crate::exit::{Exit, Outcome, unless_unread};

/// Print the manual page, or write a page for each command
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  cnc man | man -l -                         read it
  cnc man -o ~/.local/share/man/man1         install it: cnc.1, cnc-send.1, …")]
pub struct Args {
    /// Folder for a page of each command
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
}

pub fn run(args: &Args) -> Outcome {
    let command = CommandLine::command();
    if let Some(folder) = &args.output {
        let context = || format!("manual pages cannot be written to {}", folder.display());
        clap_mangen::generate_to(command, folder).with_context(context)?;
        return Ok(Exit::Ok);
    }
    let mut page = Vec::new();
    Man::new(command).render(&mut page)?;
    unless_unread(io::stdout().lock().write_all(&page))?;
    Ok(Exit::Ok)
}
