//! The skin of a body as a table or a URDF.

use std::path::Path;

use somatic::body::{Modality, Taxel};
use somatic::internal::author::mesh::urdf_of_skin;
use somatic::internal::body::taxel_table;
use somatic::internal::setup::FilesRead;
use somatic::internal::setup::bodies::load_body;
use somatic::{Error, Result, bundled};

use crate::cli::stdio::{DONE, say};
use crate::cli::words::count;

/// Whether `from` names a body rather than a recording.
pub(super) fn is_body(from: &str) -> bool {
    let ending = Path::new(from).extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    matches!(ending.as_deref(), Some("glb" | "gltf")) || bundled::body(from).is_some()
}

/// Writes the taxels of the body `from` to `to`.
pub(super) fn convert(from: &str, to: &str, force: bool) -> Result<u8> {
    let path = Path::new(to.strip_prefix("csv:").unwrap_or(to));
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    let is_table = match ending.as_deref() {
        _ if to == "csv:-" => true,
        Some("csv") => true,
        Some("urdf") => false,
        _ => return Err(Error::usage("the skin of a body becomes a .csv or a .urdf").at(format!("output `{to}`"))),
    };
    let output = FilesRead::default().bodies([&from.to_owned()]).outputs(force).add(path)?;
    let body = load_body(from)?;
    if body.taxels.is_empty() {
        let what = "it has no taxels; place some on it: somatic author --taxels 500";
        return Err(Error::failed(what).at(from));
    }
    let (text, notes) = if is_table { (taxel_table(&body), Vec::new()) } else { urdf_of_skin(&body) };
    let name = output.name().display().to_string();
    output.write(text.as_bytes())?;
    let is_written = |taxel: &&Taxel| is_table || taxel.modality == Modality::Pressure;
    let written = body.taxels.iter().filter(is_written).count();
    say(&format!("{} in {name}", count(written as u64, "taxel")));
    notes.iter().for_each(|note| say(note));
    if !body.fields.is_empty() {
        let fields = count(body.fields.len() as u64, "field");
        say(&format!("a {} has no place for fields: {fields} left out", if is_table { "table" } else { "URDF" }));
    }
    Ok(DONE)
}
