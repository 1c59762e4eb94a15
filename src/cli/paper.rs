//! `somatic paper`: the paper's experiments from simulation, and their errors.

use std::path::PathBuf;
use std::sync::Mutex;

use crate::experiments;
use clap::Args;
use somatic::error::Result;
use somatic::internal::setup::FilesRead;

use super::bar::Bar;
use super::stdio::{DONE, print};

const EXAMPLES: &str = "\
Examples:
  somatic paper --out paper                 everything, in some seconds
  somatic paper --out paper --quick         the figures, and one speed and noise of the table
  jq '.over_all_angles[] | [.indenter, .signal, .centroid_mm]' paper/table.json

table.json and table.md have the errors of place and direction for each indenter, signal, speed and
noise; the figures are drawn as the paper has them.";

/// Repeat the paper's experiments in simulation.
///
/// These are its Figs. 3, 6 and 7, with a table of errors against the truth.
///
/// Writes fig3, fig6 and fig7 as .svg and .png, and the table as table.md and table.json, and prints their names.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The folder to write into; made where there is none.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// Do one speed (20 mm/s) and one noise (1 count) of the table only.
    #[arg(long)]
    quick: bool,

    /// Replace the files if they are there.
    #[arg(long)]
    force: bool,
}

pub(super) fn paper(arguments: &Arguments) -> Result<u8> {
    let folder = FilesRead::default().outputs(arguments.force).add_folder(&arguments.out, experiments::FILES)?;
    let bar = Mutex::new(Bar::new("simulating"));
    let progress = |share: f64| {
        if let Ok(mut bar) = bar.lock() {
            bar.show(share);
        }
    };
    let written = experiments::write(folder, arguments.quick, &progress);
    drop(bar);
    let names: Vec<String> = written?.iter().map(|path| format!("{}\n", path.display())).collect();
    print(&names.concat())?;
    Ok(DONE)
}
