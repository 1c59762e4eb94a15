//! What the command measures: the paper's own experiments, from simulation, with the table of errors that it lacks
//! (`docs/paper.md`); and speed, on made-up skins of any size (`docs/performance.md`).

pub mod dump;
mod figures;
mod metric;
mod npy;
pub mod shape;
mod table;
mod trial;

use std::path::{Path, PathBuf};

use self::table::Table;
use crate::body::Body;
use crate::bundled;
use crate::error::{Error, Result};
use crate::whole;

/// Writes the paper's figures and the table into `folder`, which is made where there is none, and gives the files
/// written: each complete, or not there. `quick` leaves most of the table away. `progress` hears the share done.
///
/// # Errors
/// A file cannot be written.
pub fn write(folder: &Path, quick: bool, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<PathBuf>> {
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, &e))?;
    let body = Body::from_bytes("hand", bundled::HAND)?;
    let mut written = Vec::new();
    let mut put = |name: String, bytes: &[u8]| {
        let path = folder.join(name);
        whole::write(&path, bytes)?;
        written.push(path);
        Ok::<(), Error>(())
    };
    for figures::Named { name, figure } in figures::figures(&body)? {
        put(format!("{name}.svg"), figure.svg()?.as_bytes())?;
        put(format!("{name}.png"), &figure.png()?)?;
    }
    let table = Table::new(&body, quick, progress)?;
    put("table.md".to_owned(), table.markdown().as_bytes())?;
    let json = serde_json::to_string_pretty(&table).map_err(|e| Error::failed(e.to_string()))?;
    put("table.json".to_owned(), (json + "\n").as_bytes())?;
    Ok(written)
}
