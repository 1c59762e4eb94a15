//! Which taxel feels which part of the surface.

use std::collections::BTreeSet;

use glam::DVec3;

use super::chart;
use crate::body::{Body, PointTree, Surface, point_tree};

/// No taxel feels it.
pub(super) const UNFELT: u32 = u32::MAX;

/// A cell ends this many spacings from its taxel.
const REACH_SPACINGS: f64 = 1.5;

/// A taxel at rest.
#[derive(Clone, Debug)]
pub(super) struct Sensor {
    pub(super) position: DVec3,
    pub(super) normal: DVec3,
    link: usize,
    /// Side of a square of its area, m.
    pub(super) side_m: f64,
    /// How far its cell reaches, m.
    reach_m: f64,
}

/// The taxels of a body at rest: each point of the surface belongs to the nearest one along the surface.
pub(super) struct Cells {
    sensors: Vec<Sensor>,
    tree: PointTree,
    /// Per mesh the links that carry it.
    carriers: Vec<BTreeSet<usize>>,
    farthest_m: f64,
}

impl Cells {
    /// Of the taxels of `body` with these indices and sides of squares of their area, m.
    pub(super) fn new(body: &Body, taxels: &[(usize, f64)]) -> Self {
        let mut sensors: Vec<Sensor> = taxels
            .iter()
            .map(|&(index, side_m)| {
                let taxel = &body.taxels[index];
                let rest = &body.links[taxel.link].body_from_link;
                let (position, normal) =
                    (rest.transform_point3(taxel.position_in_link), rest.transform_vector3(taxel.normal_in_link));
                Sensor { position, normal, link: taxel.link, side_m, reach_m: side_m }
            })
            .collect();
        let tree = point_tree(sensors.iter().map(|sensor| sensor.position));
        for index in 0..sensors.len() {
            let here = &sensors[index];
            let others = tree.nearest_neighbor_iter(here.position.to_array()).map(|other| &sensors[other.data]);
            let nearest = others.map(|other| other.position.distance(here.position)).find(|&away_m| away_m > 0.0);
            let reach_m = REACH_SPACINGS * here.side_m.max(nearest.unwrap_or(0.0));
            sensors[index].reach_m = reach_m;
        }
        let links = 0..body.links.len();
        let carried = |surface: &Surface| -> BTreeSet<usize> {
            links.clone().filter(|&link| surface.is_carried_by(link)).collect()
        };
        Self {
            farthest_m: sensors.iter().map(|sensor| sensor.reach_m).fold(0.0, f64::max),
            carriers: body.surfaces.iter().map(carried).collect(),
            sensors,
            tree,
        }
    }

    pub(super) fn sensors(&self) -> &[Sensor] {
        &self.sensors
    }

    /// Whether a taxel lies on the layer over `mesh`.
    pub(super) fn is_on(&self, taxel: usize, mesh: u32) -> bool {
        self.carriers[mesh as usize].contains(&self.sensors[taxel].link)
    }

    /// The taxel nearest to `p`.
    pub(super) fn nearest(&self, p: DVec3) -> Option<&Sensor> {
        self.tree.nearest_neighbor(p.to_array()).map(|nearest| &self.sensors[nearest.data])
    }

    /// The taxel in whose cell the point `p` of `mesh` lies, where the normal is `normal`.
    pub(super) fn taxel_at(&self, p: DVec3, normal: DVec3, mesh: u32) -> Option<u32> {
        let (mut best, mut least_m) = (None, f64::INFINITY);
        for (other, squared) in self.tree.nearest_neighbor_iter_with_distance_2(p.to_array()) {
            // Along the surface nothing is nearer than straight.
            if squared >= least_m * least_m || squared > self.farthest_m * self.farthest_m {
                break;
            }
            let sensor = &self.sensors[other.data];
            if !chart::is_beside(normal, sensor.normal) || !self.is_on(other.data, mesh) {
                continue;
            }
            let away_m = chart::distance(sensor.position - p, normal, sensor.normal);
            if away_m < least_m && away_m <= sensor.reach_m {
                (best, least_m) = (Some(other.data as u32), away_m);
            }
        }
        best
    }
}
