//! Taxels on a hexagonal or rectangular grid in a geodesic chart, found by straight walks over the surface from its origin.

use std::collections::BTreeSet;

use glam::{DVec2, DVec3};

use super::grid::Grid;
use super::placed::{Placed, Progress, SurfacePoint, report_progress, same_side};
use super::rest_surface::RestSurface;
use crate::body::{SurfaceIndex, Topology, area_vector};
use crate::error::{Error, Result, failed};
use crate::field::default_u;
use crate::field::geodesic::{FIRST_LIMIT, LogMap, SurfacePlace, walk};

/// How often the limit is doubled before a part of the region counts as unreachable.
const MAX_DOUBLINGS: u32 = 6;

const MAX_GRID_POINTS: f64 = 4e6;

/// A walk longer than the shortest distance by this share is not the shortest path, and is dropped.
const DETOUR_TOLERANCE: f64 = 1e-6;

/// A grid as requested.
pub(super) struct Lattice {
    pub(super) hexagonal: bool,
    pub(super) pitch_m: f64,
    /// Its origin is the nearest surface point, in the body; the middle of the region by default.
    pub(super) origin: Option<DVec3>,
    /// Direction of its rows, in the body.
    pub(super) u: Option<DVec3>,
}

/// A place of the grid: its column and its row, from the origin.
pub(super) type GridCell = [i64; 2];

pub(super) struct LaidGrid {
    /// Row by row, each with the area of a cell of the grid.
    pub(super) placed: Vec<Placed>,
    /// Where each of them is in the grid.
    pub(super) cells: Vec<GridCell>,
    /// Places in the region that got no point, as the grid comes there another way.
    pub(super) dropped: BTreeSet<GridCell>,
    /// The share of the region's surface that is connected to the origin.
    pub(super) reached_share: f64,
}

impl Lattice {
    /// Lays it on the triangles of `rest_surface` that are in `region`.
    pub(super) fn lay(
        &self,
        rest_surface: &RestSurface<'_>,
        region: &[bool],
        progress: Progress<'_>,
    ) -> Result<LaidGrid> {
        let topology = rest_surface.topology();
        let sound: Vec<u32> = (0..topology.triangles.len() as u32)
            .filter(|&triangle| region[topology.given[triangle as usize] as usize])
            .collect();
        let start = self.start(topology, &sound)?;
        let part = topology.part[start.triangle as usize];
        let area = |triangle: u32| rest_surface.area(topology.given[triangle as usize] as usize);
        let whole: f64 = sound.iter().map(|&triangle| area(triangle)).sum();
        let near: Vec<u32> = sound.into_iter().filter(|&triangle| topology.part[triangle as usize] == part).collect();
        let reached_share = near.iter().map(|&triangle| area(triangle)).sum::<f64>() / whole;
        let map = self.map(topology, start, &near)?;
        let extent = extent(&map, &near);
        let cells = self.cells(extent)?;
        report_progress(progress, 0.3)?;
        let [from, u, v, _] = map.frame();
        let cell_area = self.cell_m2();
        let mut found: Vec<(f64, Placed, GridCell)> = Vec::new();
        let mut dropped = BTreeSet::new();
        let count = cells.len();
        for (index, (at, cell)) in cells.into_iter().enumerate() {
            if index.is_multiple_of(512) {
                report_progress(progress, 0.3 + 0.7 * index as f64 / count as f64)?;
            }
            let length = cell.length();
            let direction = if length > 0.0 { (u * cell.x + v * cell.y) / length } else { u };
            let Ok(place) = walk(topology, start.triangle, from, direction, length) else { continue };
            let triangle = topology.given[place.triangle as usize] as usize;
            if !region[triangle] {
                continue;
            }
            let shortest = map.reach(&place).map_or(0.0, |way| way.distance_m);
            if shortest >= length * (1.0 - DETOUR_TOLERANCE) {
                let normal = area_vector(topology.corners(place.triangle)).normalize_or_zero();
                let point = SurfacePoint { position: place.position(topology), normal, area: cell_area };
                found.push((length, Placed { point, triangle, barycentric: place.barycentric }, at));
            } else {
                dropped.insert(at);
            }
        }
        let kept = self.without_overlaps(&found);
        let (mut placed, mut cells) = (Vec::new(), Vec::new());
        for ((_, one, at), is_kept) in found.into_iter().zip(kept) {
            if is_kept {
                placed.push(one);
                cells.push(at);
            } else {
                dropped.insert(at);
            }
        }
        Ok(LaidGrid { placed, cells, dropped, reached_share })
    }

    /// The area of a cell of the grid, m².
    pub(super) fn cell_m2(&self) -> f64 {
        self.pitch_m * self.row_m()
    }

    /// The distance between two rows, m.
    fn row_m(&self) -> f64 {
        self.pitch_m * if self.hexagonal { 3.0_f64.sqrt() / 2.0 } else { 1.0 }
    }

    /// The places one pitch away from a place of the grid.
    pub(super) fn around(&self, [column, row]: GridCell) -> Vec<GridCell> {
        let mut around = vec![[column - 1, row], [column + 1, row]];
        for next in [row - 1, row + 1] {
            around.push([column, next]);
            if self.hexagonal {
                // Odd rows are half a pitch on.
                around.push([if row % 2 == 0 { column - 1 } else { column + 1 }, next]);
            }
        }
        around
    }

    fn start(&self, topology: &Topology, sound: &[u32]) -> Result<SurfacePlace> {
        let index = SurfaceIndex::of_triangles(sound.iter().map(|&triangle| topology.corners(triangle)));
        let weighted = |&triangle: &u32| {
            let [a, b, c] = topology.corners(triangle);
            let area = area_vector([a, b, c]).length();
            (area, (a + b + c) * (area / 3.0))
        };
        let (area, sum) = sound.iter().map(weighted).fold((0.0, DVec3::ZERO), |(a, s), (b, t)| (a + b, s + t));
        let wanted = self.origin.unwrap_or(sum / area);
        let hit = index.nearest(wanted).ok_or_else(|| Error::failed("the surface has no area to lay a grid on"))?;
        Ok(SurfacePlace::in_triangle(topology, sound[hit.triangle], hit.position).inward())
    }

    /// The distances to all of the triangles `near`.
    fn map<'t>(&self, topology: &'t Topology, start: SurfacePlace, near: &[u32]) -> Result<LogMap<'t>> {
        let normal = area_vector(topology.corners(start.triangle)).normalize_or_zero();
        let u = self.u.unwrap_or(default_u(normal));
        let from = start.position(topology);
        let corners = near.iter().flat_map(|&triangle| topology.corners(triangle));
        let mut limit = corners.map(|corner| corner.distance(from)).fold(self.pitch_m, f64::max) * FIRST_LIMIT;
        for _ in 0..MAX_DOUBLINGS {
            let map = LogMap::new(topology, start, u, limit)?;
            if extent(&map, near) <= limit {
                return Ok(map);
            }
            limit *= 2.0;
        }
        Err(Error::failed("the region winds too far away from the grid's origin; split it"))
    }

    /// The grid's places, and where they are from its origin, up to one pitch farther than `extent`, row by row.
    fn cells(&self, extent: f64) -> Result<Vec<(GridCell, DVec2)>> {
        let row_m = self.row_m();
        let reach_m = extent + self.pitch_m;
        let (rows, columns) = ((reach_m / row_m).floor(), (reach_m / self.pitch_m).floor() + 1.0);
        if 4.0 * rows * columns > MAX_GRID_POINTS {
            return Err(failed!(
                "a grid of {} m on a region that reaches {extent:.3} m has too many places; is `pitch` in metres?",
                self.pitch_m
            ));
        }
        let (rows, columns) = (rows as i64, columns as i64);
        let mut cells = Vec::new();
        for row in -rows..=rows {
            let shift = if self.hexagonal && row % 2 != 0 { 0.5 } else { 0.0 };
            for column in -columns..=columns {
                let from_origin = DVec2::new((column as f64 + shift) * self.pitch_m, row as f64 * row_m);
                if from_origin.length() <= reach_m {
                    cells.push(([column, row], from_origin));
                }
            }
        }
        Ok(cells)
    }

    /// Which are left without overlaps behind a wrapped part: of points closer than half the pitch, the one farther from the origin goes.
    fn without_overlaps(&self, found: &[(f64, Placed, GridCell)]) -> Vec<bool> {
        let positions: Vec<DVec3> = found.iter().map(|(_, placed, _)| placed.point.position).collect();
        let grid = Grid::new(&positions, 0..positions.len() as u32, self.pitch_m / 2.0);
        let mut nearest_first: Vec<usize> = (0..found.len()).collect();
        nearest_first.sort_by(|&a, &b| found[a].0.total_cmp(&found[b].0).then(a.cmp(&b)));
        let mut kept = vec![false; found.len()];
        for i in nearest_first {
            let around = grid.around(grid.cube(positions[i]));
            let meets = |&(p, j): &(DVec3, u32)| {
                kept[j as usize]
                    && p.distance(positions[i]) < self.pitch_m / 2.0
                    && same_side(&found[i].1, &found[j as usize].1)
            };
            kept[i] = !around.into_iter().flatten().any(meets);
        }
        kept
    }
}

/// The maximum distance to the corners of `near`, m; infinite if one is not reached.
fn extent(map: &LogMap<'_>, near: &[u32]) -> f64 {
    let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let places = near.iter().flat_map(|&triangle| corners.map(|barycentric| SurfacePlace { triangle, barycentric }));
    places.map(|place| map.reach(&place).map_or(f64::INFINITY, |way| way.distance_m)).fold(0.0, f64::max)
}
