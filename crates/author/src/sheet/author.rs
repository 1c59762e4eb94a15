//! Sheets as files, with a report, as [`crate::author`] gives it for meshes.

use std::collections::BTreeMap;

use crate::body::{Body, Original, Sheet, sheets};
use crate::error::Result;
use crate::place::nearest_on_its_side;
use crate::placed::SurfacePoint;
use crate::report::PlaceReport;
use crate::skin::{Authored, store_edges};

/// The body of `sheets_of` as a file called `name` in messages, with a report for each sheet.
///
/// # Errors
/// As [`sheets`].
pub fn author_sheets(name: &str, sheets_of: &[Sheet]) -> Result<Authored> {
    let mut file = Original::from_bytes(name, &sheets(sheets_of)?.to_bytes()?, None)?;
    let (mut body, _) = file.read()?;
    let mut notes = Vec::new();
    store_edges(&mut file, &mut body, &mut notes, None);
    let places = sheets_of.iter().map(|sheet| report(&body, sheet)).collect();
    Ok(Authored { file, body, places, notes })
}

fn report(body: &Body, sheet: &Sheet) -> PlaceReport {
    let ids: Vec<u32> = sheet.cells.iter().map(|cell| cell.id).collect();
    let taxels = ids.iter().filter_map(|&id| body.taxel_index(id)).map(|index| &body.taxels[index]);
    let points: Vec<SurfacePoint> = taxels
        .map(|taxel| SurfacePoint { position: taxel.position_in_link, normal: taxel.normal_in_link, area: taxel.area })
        .collect();
    let near: Vec<f64> = nearest_on_its_side(&points).into_iter().flatten().collect();
    PlaceReport {
        name: sheet.name.clone(),
        links: BTreeMap::from([(sheet.name.clone(), ids.len())]),
        ids,
        least_spacing_m: near.iter().copied().reduce(f64::min),
        mean_spacing_m: (!near.is_empty()).then(|| near.iter().sum::<f64>() / near.len() as f64),
        ..PlaceReport::default()
    }
}
