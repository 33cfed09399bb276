//! `cnc man`: manual pages, made from the same text as `--help`.

use std::io::{self, Write};
use std::path::PathBuf;

use anyhow::{Context, anyhow};
use clap_mangen::Man;
use cnc::base::source::shown;

use crate::args::{self, Global};
use crate::exit::{Exit, Outcome, unless_unread};

/// Print the manual page, or write a page for each command
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder for a page of each command, which is made if it is not there
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    global.refuse(&["json", "machine"], "a manual page is printed")?;
    let command = args::command_for_man();
    if let Some(folder) = &args.output {
        if folder.exists() && !folder.is_dir() {
            return Err(anyhow!("{} is no folder: name one for the pages", shown(folder)).into());
        }
        let context = || format!("manual pages cannot be written to {}", folder.display());
        std::fs::create_dir_all(folder).with_context(context)?;
        clap_mangen::generate_to(command, folder).with_context(context)?;
        return Ok(Exit::Ok);
    }
    let mut page = Vec::new();
    Man::new(command).render(&mut page)?;
    unless_unread(io::stdout().lock().write_all(&page))?;
    Ok(Exit::Ok)
}
