//! A table of taxels as a body of its own, without a mesh.

use std::collections::BTreeMap;
use std::path::Path;

use glam::DVec3;

use super::recipe::Recipe;
use super::report::PlaceReport;
use super::skin::{Authored, author};
use crate::body::{Glb, Original, Taxel, TaxelRow, read_taxel_table};
use crate::error::{Error, Result, failed};
use crate::limits::{self, MAX_TABLE_BYTES};

/// Between links that lie side by side, m.
const GAP_M: f64 = 0.05;

/// A body of the table at `path` with the columns `id`, `x`, `y`, `z`, `nx`, `ny`, `nz`, and optionally `link`, `area`,
/// `modality`, `tx`, `ty`, `tz`: a link for each that is named, else one called as the file, with fields as without rules. A table does not
/// say how links stand to each other: they lie side by side.
///
/// # Errors
/// The file cannot be read, is not such a table, or leaves out a normal; with the line.
pub fn author_csv_skin(path: &Path) -> Result<Authored> {
    let file = limits::open(path, MAX_TABLE_BYTES).map_err(|e| Error::io(path, &e))?;
    let rows = read_taxel_table(file, false).map_err(|e| e.at(path.display()))?;
    place(&rows, path).map_err(|e| e.at(path.display()))
}

fn place(rows: &[TaxelRow], path: &Path) -> Result<Authored> {
    let stem = path.file_stem().map_or_else(|| "skin".to_owned(), |stem| stem.to_string_lossy().into_owned());
    // In the order of the table.
    let mut links: Vec<(&str, Vec<Taxel>)> = Vec::new();
    let mut index_of = BTreeMap::new();
    for row in rows {
        let normal_in_link = row.normal.ok_or_else(|| {
            let what =
                "it has no normal (nx, ny, nz), which only a mesh can give; place it on one by `csv` in a recipe";
            failed!("taxel {}: {what}", row.id).at(format!("line {}", row.line))
        })?;
        let link = row.link.as_deref().unwrap_or(&stem);
        let index = *index_of.entry(link).or_insert_with(|| {
            links.push((link, Vec::new()));
            links.len() - 1
        });
        links[index].1.push(Taxel {
            id: row.id,
            link: 0,
            position_in_link: row.position,
            normal_in_link,
            area: row.area_m2.unwrap_or(0.0),
            modality: row.modality.unwrap_or_default(),
            tangent_in_link: row.tangent,
        });
    }
    let mut glb = Glb::new();
    let (mut places, mut left_m) = (Vec::new(), 0.0);
    for (link, taxels) in &links {
        let xs = || taxels.iter().map(|taxel| taxel.position_in_link.x);
        let (low, high) = xs().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        let at = if links.len() > 1 { DVec3::X * (left_m - low) } else { DVec3::ZERO };
        left_m += high - low + GAP_M;
        let node = glb.node(link, None, at);
        glb.taxels(&format!("{link} taxels"), Some(node), taxels, None);
        places.push(PlaceReport {
            name: (*link).to_owned(),
            ids: taxels.iter().map(|taxel| taxel.id).collect(),
            links: BTreeMap::from([((*link).to_owned(), taxels.len())]),
            least_spacing_m: None,
            mean_spacing_m: None,
            ..PlaceReport::default()
        });
    }
    let file = Original::from_bytes(&path.display().to_string(), &glb.to_bytes()?, None)?;
    let mut made = author(file, &Recipe::none(), |_| {})?;
    if links.len() > 1 {
        made.notes.push("a table has no poses of links: they lie side by side".to_owned());
    }
    Ok(Authored { places, ..made })
}
