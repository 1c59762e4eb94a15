//! Experiments: the paper's figures from simulation, with a table of errors (`docs/evidence/paper.md`).

mod chart_fit;
mod figures;
mod kalman;
mod metric;
mod motion;
mod table;
mod trial;

use std::path::PathBuf;

use self::table::Table;
use somatic::body::Body;
use somatic::bundled;
use somatic::error::{Error, Result};
use somatic::internal::output::OutputFolder;

/// The files that [`write()`] writes.
pub const FILES: [&str; 9] =
    ["fig3.svg", "fig3.png", "fig6.svg", "fig6.png", "fig7.svg", "fig7.png", "motion.md", "table.md", "table.json"];

/// Writes the paper's figures and the table into `folder`, which has [`FILES`], and returns the files. `quick` omits most of
/// the table. `progress` gets the share that is done.
pub fn write(mut folder: OutputFolder, quick: bool, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<PathBuf>> {
    let body = Body::from_bytes("hand", bundled::HAND)?;
    let mut made: Vec<(String, Vec<u8>)> = Vec::new();
    for figures::NamedFigure { name, figure } in figures::figures(&body)? {
        made.push((format!("{name}.svg"), figure.svg()?.into_bytes()));
        made.push((format!("{name}.png"), figure.png()?));
    }
    let motion = motion::markdown(&body, quick, &|share| progress(0.5 * share))?;
    made.push(("motion.md".to_owned(), motion.into_bytes()));
    let table = Table::new(&body, quick, &|share| progress(0.5 + 0.5 * share))?;
    made.push(("table.md".to_owned(), table.markdown().into_bytes()));
    let json = serde_json::to_string_pretty(&table).map_err(|e| Error::failed(e.to_string()))?;
    made.push(("table.json".to_owned(), (json + "\n").into_bytes()));
    // All of them are of one run: nothing is written before all are there.
    folder.make()?;
    let write = |(name, bytes): (String, Vec<u8>)| {
        let output = folder.take(&name);
        let path = output.name().to_owned();
        output.write(&bytes).map(|()| path)
    };
    made.into_iter().map(write).collect()
}
