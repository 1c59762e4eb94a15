//! The iCub's position files as a body of their own, without a mesh.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use glam::DVec3;

use super::icub::{IcubFile, IcubTaxel};
use super::report::PlaceReport;
use super::skin::{Authored, store_edges};
use crate::body::{Glb, Original, Taxel};
use crate::error::{Error, Result, failed};
use crate::limits::{self, MAX_TABLE_BYTES};

/// Ids of the second file begin at a multiple of this, and so on.
const ID_STEP: u32 = 1000;

/// Between links that lie side by side, m.
const GAP_M: f64 = 0.05;

/// A body with a link for each of `files`, called as the part that the file names, with its taxels and fields: the part, and
/// below it a field for each triangle of the skin. Ids are channels, those of the second file from the next multiple of 1000
/// on. The files do not say how links stand to each other: they lie side by side.
///
/// # Errors
/// A file cannot be read, or two are of one part; with the file and line.
pub fn author_icub(files: &[impl AsRef<Path>]) -> Result<Authored> {
    let mut glb = Glb::new();
    let (mut parts, mut places, mut notes) = (BTreeSet::new(), Vec::new(), Vec::new());
    let (mut first_id, mut left_m) = (0_u32, 0.0);
    for path in files {
        let path = path.as_ref();
        let text = limits::read_to_string(path, MAX_TABLE_BYTES).map_err(|e| Error::io(path, &e))?;
        let file = IcubFile::read(&text).map_err(|e| e.at(path.display()))?;
        if !parts.insert(file.part.clone()) {
            return Err(failed!("another file is of the part `{}` too; give one of each", file.part).at(path.display()));
        }
        let taxel = |(channel, taxel): (u32, &IcubTaxel)| Taxel {
            id: first_id + channel,
            link: 0,
            position_in_link: taxel.position_in_link,
            normal_in_link: taxel.normal_in_link,
            area: 0.0,
            modality: taxel.modality,
            tangent_in_link: None,
        };
        let taxels: Vec<Taxel> = file.taxels().map(taxel).collect();
        let (low, high) = taxels.iter().fold((DVec3::MAX, DVec3::MIN), |(low, high), taxel| {
            (low.min(taxel.position_in_link), high.max(taxel.position_in_link))
        });
        let link = glb.node(&file.part, None, DVec3::new(left_m - low.x, 0.0, 0.0));
        left_m += high.x - low.x + GAP_M;
        glb.taxels(&format!("{} taxels", file.part), Some(link), &taxels, None);
        let place_of: BTreeMap<u32, DVec3> = taxels.iter().map(|taxel| (taxel.id, taxel.position_in_link)).collect();
        for field in file.fields(first_id) {
            let first = field.members.keys().next().and_then(|id| place_of.get(id));
            glb.field(&field, Some(link), first.copied().unwrap_or(DVec3::ZERO));
        }
        places.push(PlaceReport {
            name: file.part.clone(),
            ids: taxels.iter().map(|taxel| taxel.id).collect(),
            links: BTreeMap::from([(file.part.clone(), taxels.len())]),
            least_spacing_m: None,
            mean_spacing_m: None,
            ..PlaceReport::default()
        });
        notes.extend(file.notes);
        first_id = (first_id + file.rows.len() as u32).next_multiple_of(ID_STEP);
    }
    if files.len() > 1 {
        notes.push("position files have no poses of links: they lie side by side".to_owned());
    }
    notes.push("areas are unknown without a surface: put them on a mesh by `icub` in a recipe to have them".to_owned());
    let mut file = Original::from_bytes("icub.glb", &glb.to_bytes()?, None)?;
    let (mut body, _) = file.read()?;
    store_edges(&mut file, &mut body, &mut notes, None);
    Ok(Authored { file, body, places, notes })
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEFT: &str = "name left_hand\nspatial_sampling taxel\ntaxel2Repr ( 0 0 -1 )\n[calibration]\n\
                        0.01 0 0 0 0 1\n0.02 0 0 0 0 1\n0 0 0 0 0 0\n";

    #[test]
    fn each_file_is_a_link_with_every_taxel_accounted_for() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        let files = [at("l.txt", LEFT), at("r.txt", &LEFT.replace("left", "right"))];
        let made = author_icub(&files).unwrap();
        assert_eq!(
            made.places.iter().map(|place| place.ids.clone()).collect::<Vec<_>>(),
            [vec![0, 1], vec![1000, 1001]]
        );
        assert_eq!(made.body.links.len(), 2);
        assert!(
            made.body.fields.len() >= 4 && made.notes.iter().any(|note| note.contains("absent")),
            "{:?}",
            made.notes
        );
        let twice = author_icub(&[files[0].clone(), files[0].clone()]).unwrap_err().to_string();
        assert!(twice.contains("another file is of the part"), "{twice}");
    }
}
