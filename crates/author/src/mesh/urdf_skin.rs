//! A robot whose URDF has its skin: taxels where `<sensor><tactile>` says they are.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use glam::DVec3;

use super::options::MeshOptions;
use super::urdf::{self, Linked};
use super::urdf_file::Robot;
use crate::body::{MAX_TAXEL_ID, Modality, Original, Taxel};
use crate::error::{Error, Result, failed};
use crate::recipe::Recipe;
use crate::report::PlaceReport;
use crate::skin::{Authored, author};

/// The body of the URDF at `path` with the taxels of its `<sensor><tactile>`, grouped into fields as without rules. An id is
/// the index in the sensor's data vector, plus the number of those before it: sensors with one `channel` share a vector.
///
/// # Errors
/// The file cannot be read or is invalid, has no tactile sensor, or gives two taxels one index; with the line.
pub fn author_urdf_skin(path: &Path, options: &MeshOptions) -> Result<Authored> {
    let robot = Robot::load(path, options)?;
    place(&robot, path, options).map_err(|e| e.at(path.display()))
}

fn place(robot: &Robot, path: &Path, options: &MeshOptions) -> Result<Authored> {
    if robot.sensors.is_empty() {
        return Err(Error::failed(
            "it has no <sensor> with a <tactile>; place taxels on its meshes instead: --taxels 500",
        ));
    }
    let first_of = first_ids(robot)?;
    let Linked { mut glb, nodes, notes, .. } = urdf::links(robot, options)?;
    let mut used = BTreeSet::new();
    let (mut places, mut by_link) = (Vec::new(), BTreeMap::<&str, Vec<Taxel>>::new());
    for sensor in &robot.sensors {
        let at = |what: String| Error::failed(what).at(format!("line {}", sensor.line));
        if !nodes.contains_key(&sensor.link) {
            return Err(at(format!("sensor `{}` is on `{}`, and there is no such link", sensor.name, sensor.link)));
        }
        let mut ids = Vec::with_capacity(sensor.taxels.len());
        for taxel in &sensor.taxels {
            let id = first_of[sensor.channel.as_str()] + taxel.index;
            if !used.insert(id) {
                return Err(at(format!("sensor `{}` has a second taxel of index {}", sensor.name, taxel.index)));
            }
            ids.push(id);
            by_link.entry(&sensor.link).or_default().push(Taxel {
                id,
                link: 0,
                position_in_link: taxel.link_from_taxel.translation,
                normal_in_link: taxel.link_from_taxel.transform_vector3(DVec3::Z),
                area: taxel.area_m2,
                modality: Modality::Pressure,
                tangent_in_link: None,
            });
        }
        places.push(PlaceReport {
            name: sensor.name.clone(),
            links: BTreeMap::from([(sensor.link.clone(), ids.len())]),
            ids,
            least_spacing_m: None,
            mean_spacing_m: None,
            ..PlaceReport::default()
        });
    }
    for (link, taxels) in &by_link {
        glb.taxels(&format!("{link} taxels"), nodes.get(*link).copied(), taxels, None);
    }
    let file = Original::from_bytes(&path.display().to_string(), &glb.to_bytes()?, None)?;
    let mut made = author(file, &Recipe::none(), |_| {})?;
    made.notes.extend(notes);
    Ok(Authored { places, ..made })
}

/// By channel, the id of index 0.
fn first_ids(robot: &Robot) -> Result<BTreeMap<&str, u32>> {
    let mut lengths: Vec<(&str, u64)> = Vec::new();
    let mut known: BTreeMap<&str, usize> = BTreeMap::new();
    for sensor in &robot.sensors {
        let length = sensor.taxels.iter().map(|taxel| u64::from(taxel.index) + 1).max().unwrap_or(0);
        let index = *known.entry(&sensor.channel).or_insert(lengths.len());
        match lengths.get_mut(index) {
            Some((_, known)) => *known = length.max(*known),
            None => lengths.push((&sensor.channel, length)),
        }
    }
    let mut next = 0;
    let mut first = BTreeMap::new();
    for (channel, length) in lengths {
        first.insert(channel, next as u32);
        next += length;
        if next > u64::from(MAX_TAXEL_ID) + 1 {
            return Err(failed!("its indices reach {next}, over the {MAX_TAXEL_ID} that a file can hold"));
        }
    }
    Ok(first)
}
