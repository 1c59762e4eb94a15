//! The connected parts of a link's surface, and whether anything outside reaches them.

use std::cell::OnceCell;
use std::collections::BTreeMap;

use glam::{DAffine3, DVec3};

use super::posed_surface::{PosedSurface, START_M, skinned};
use crate::body::{Body, Home, SurfaceIndex, Topology, area_vector};

/// Samples of a shell: least and greatest number, and the area that adds one, m².
const MIN_SAMPLES: usize = 24;
const MAX_SAMPLES: usize = 400;
const AREA_PER_SAMPLE_M2: f64 = 1e-4;

/// A shell is open if a ray escapes from this share of its samples.
const OPEN_SHARE: f64 = 0.01;

/// Connected parts of the surfaces that are a link's own, in the body at rest.
pub(super) struct Shells {
    index: SurfaceIndex,
    topology: Topology,
    open: Vec<OnceCell<bool>>,
}

/// By link, its shells.
pub(super) struct ShellsOfLinks<'a> {
    body: &'a Body,
    known: BTreeMap<usize, Shells>,
}

impl<'a> ShellsOfLinks<'a> {
    pub(super) fn new(body: &'a Body) -> Self {
        Self { body, known: BTreeMap::new() }
    }

    pub(super) fn for_link(&mut self, link: usize) -> &Shells {
        self.known.entry(link).or_insert_with(|| Shells::of_link(self.body, link))
    }
}

impl Shells {
    fn of_link(body: &Body, link: usize) -> Self {
        let mut corners: Vec<DVec3> = Vec::new();
        for surface in &body.surfaces {
            match &surface.home {
                Home::Rigid { link: own, link_from_mesh } if *own == link => {
                    let way = body.links[link].body_from_link * *link_from_mesh;
                    corners.extend(surface.corners_through(way).flatten());
                }
                Home::Skinned { joints, .. } if joints.iter().any(|(joint, _)| *joint == link) => {
                    let rest: Vec<DAffine3> = body.links.iter().map(|link| link.body_from_link).collect();
                    corners.extend(skinned(surface, &rest, &rest).flatten());
                }
                _ => {}
            }
        }
        let triangles: Vec<[u32; 3]> = (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let topology = Topology::new(&corners, &triangles);
        let index = SurfaceIndex::of_triangles((0..topology.triangles.len() as u32).map(|t| topology.corners(t)));
        let open = vec![OnceCell::new(); topology.parts()];
        Self { index, topology, open }
    }

    /// Whether a ray escapes from the shell at `p`, in the body at rest.
    pub(super) fn is_open_at(&self, p: DVec3, surface: &PosedSurface<'_>, directions: &[DVec3]) -> bool {
        let Some(hit) = self.index.nearest(p) else { return true };
        let part = self.topology.part[hit.triangle];
        *self.open[part as usize].get_or_init(|| self.is_open(part, surface, directions))
    }

    fn is_open(&self, part: u32, surface: &PosedSurface<'_>, directions: &[DVec3]) -> bool {
        let own = || (0..self.topology.triangles.len() as u32).filter(|&t| self.topology.part[t as usize] == part);
        let area = |triangle: u32| area_vector(self.topology.corners(triangle)).length() / 2.0;
        let whole: f64 = own().map(area).sum();
        let count = ((whole / AREA_PER_SAMPLE_M2) as usize).clamp(MIN_SAMPLES, MAX_SAMPLES);
        let enough = (OPEN_SHARE * count as f64).ceil().max(1.0) as usize;
        let (mut up_to, mut taken, mut open, mut last) = (0.0, 0_usize, 0_usize, 0_usize);
        for triangle in own() {
            up_to += area(triangle);
            let corners = self.topology.corners(triangle);
            let Some(normal) = area_vector(corners).try_normalize() else { continue };
            while (taken as f64 + 0.5) * whole < up_to * count as f64 && taken < count {
                let [a, b, c] = corners;
                // Weights of a quasirandom sequence, as for coverage.
                let step = |by: f64| (0.5 + by * taken as f64).fract();
                let [beta, gamma] = [step(0.754_877_666_246_692_7), step(0.569_840_290_998_053_3)];
                let [beta, gamma] = if beta + gamma > 1.0 { [1.0 - beta, 1.0 - gamma] } else { [beta, gamma] };
                let start = a + (b - a) * beta + (c - a) * gamma + normal * START_M;
                open += usize::from(directions.iter().any(|&way| surface.escapes(0, start, way, &mut last)));
                taken += 1;
            }
            if open >= enough {
                return true;
            }
        }
        false
    }
}
