//! The surface of a body at rest, divided into the cells of its pressure taxels.

use glam::DVec3;

use super::cells::Cells;
use super::geodesic::SurfacePlace;
use super::seats::{Group, Seat, Seated};
use crate::body::Body;

/// Which part of a body's surface belongs to which taxel.
pub struct CellSurface {
    /// Per taxel of the body its share of the surface, m²: taxels at one place share a cell. `None` for one on no surface, and
    /// for one that measures no pressure.
    pub area_m2: Vec<Option<f64>>,
    /// Per taxel the one whose cell it has, itself unless another is at its place.
    pub cell_of: Vec<u32>,
    /// Triangles in the frame of the body at rest, counter-clockwise seen from outside, each with the taxel whose cell it is in.
    pub triangles: Vec<(u32, [DVec3; 3])>,
}

impl CellSurface {
    /// The cells of the pressure taxels of `body`, whose taxels are `seated`.
    pub fn new(body: &Body, seated: &Seated) -> Self {
        let is_node = |taxel: usize| body.taxels[taxel].modality.is_pressed();
        let nodes: Vec<usize> = (0..body.taxels.len()).filter(|&taxel| is_node(taxel)).collect();
        let mut within: Vec<Vec<(usize, SurfacePlace)>> = vec![Vec::new(); seated.groups.len()];
        for &taxel in &nodes {
            if let Some(Seat { group, place }) = &seated.seats[taxel] {
                within[*group].push((taxel, *place));
            }
        }
        let mut surface = Self {
            area_m2: vec![None; body.taxels.len()],
            cell_of: (0..body.taxels.len() as u32).collect(),
            triangles: Vec::new(),
        };
        for (group, seats) in seated.groups.iter().zip(within) {
            surface.add(body, group, seats);
        }
        surface
    }

    fn add(&mut self, body: &Body, group: &Group, seats: Vec<(usize, SurfacePlace)>) {
        let (taxels, places): (Vec<usize>, Vec<SurfacePlace>) = seats.into_iter().unzip();
        let cells = Cells::with_surface(&group.surface.topology, &places);
        let mut sharing = vec![0_u32; taxels.len()];
        cells.first.iter().for_each(|&first| sharing[first as usize] += 1);
        for (point, &taxel) in taxels.iter().enumerate() {
            let first = cells.first[point] as usize;
            // Where the surface is too rough there are no cells.
            if cells.areas[point] > 0.0 {
                self.area_m2[taxel] = Some(cells.areas[point] / f64::from(sharing[first]));
                self.cell_of[taxel] = taxels[first] as u32;
            }
        }
        let rest = body.links[group.anchor].body_from_link;
        let placed = |corners: [DVec3; 3]| corners.map(|corner| rest.transform_point3(corner));
        let triangles = cells.surface.into_iter();
        self.triangles.extend(triangles.map(|(point, corners)| (taxels[point as usize] as u32, placed(corners))));
    }
}
