//! Whether a grid keeps its pitch on the surface that it was laid on.
//!
//! Rows are laid from an origin, so that a grid is exact on what unrolls. On a surface that is bent both ways its rows draw together or
//! apart, and behind a limb they meet from two sides. Distances are those of the cells of its points, along the surface.

use std::collections::BTreeMap;

use glam::DVec3;

use super::lattice::{GridCell, LaidGrid, Lattice};
use super::place::set_cell_areas;
use super::placed::Placed;
use super::rest_surface::RestSurface;

/// Least and greatest distance of neighbours, in pitches.
const LEAST: f64 = 0.8;
const MOST: f64 = 1.25;

/// Two points of a grid that are too near, or too far from each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tear {
    /// Where they are in the body at rest, m.
    pub(super) ends: [DVec3; 2],
    /// How far they are apart along the surface, m.
    pub(super) distance_m: f64,
}

/// The worst pair of points of `laid`, which is `lattice` on the triangles of `rest_surface` in `region`, if any is out of bounds:
///
/// - two points with a common border are nearer to each other along the surface than 0.8 of the pitch;
/// - two that are next to each other in the grid are farther apart than 1.25 of it, in a straight line;
/// - a cell is larger than 1.25² of the grid's, though surface goes on on all its sides: its farthest neighbour counts. At a
///   border, a cell may be larger.
pub(super) fn worst_tear(
    lattice: &Lattice,
    laid: &LaidGrid,
    rest_surface: &RestSurface<'_>,
    region: &[bool],
) -> Option<Tear> {
    let pitch_m = lattice.pitch_m;
    let position = |point: usize| laid.placed[point].point.position;
    // By how much a distance is off, as a factor.
    let off = |distance_m: f64| (distance_m / pitch_m).max(pitch_m / distance_m);
    let mut worst: Option<Tear> = None;
    let mut take = |a: usize, b: usize, distance_m: f64| {
        if worst.is_none_or(|known| off(distance_m) > off(known.distance_m)) {
            worst = Some(Tear { ends: [position(a), position(b)], distance_m });
        }
    };
    let at: BTreeMap<GridCell, usize> = laid.cells.iter().enumerate().map(|(point, &cell)| (cell, point)).collect();
    for (point, &cell) in laid.cells.iter().enumerate() {
        for other in lattice.around(cell).iter().filter_map(|cell| at.get(cell)).filter(|other| **other > point) {
            let distance_m = position(point).distance(position(*other));
            if distance_m > MOST * pitch_m {
                take(point, *other, distance_m);
            }
        }
    }
    let chosen: Vec<usize> = (0..region.len()).filter(|&triangle| region[triangle]).collect();
    let triangles: Vec<[u32; 3]> = chosen.iter().map(|&triangle| rest_surface.triangles[triangle]).collect();
    let mut number = vec![0; region.len()];
    chosen.iter().enumerate().for_each(|(index, &triangle)| number[triangle] = index);
    let mut placed: Vec<Placed> =
        laid.placed.iter().map(|one| Placed { triangle: number[one.triangle], ..*one }).collect();
    let all = vec![true; triangles.len()];
    // Grids are laid over everything that is connected, whatever mesh it is of.
    let divided = set_cell_areas(&rest_surface.positions, &triangles, &|_| 0, (&all, None), &mut placed);
    let Some(divided) = divided else { return worst };
    let mut farthest: Vec<Option<(f64, usize)>> = vec![None; placed.len()];
    for (&(a, b), border) in &divided.cells.borders {
        let (a, b) = (a as usize, b as usize);
        if border.path_m < LEAST * pitch_m {
            take(a, b, border.path_m);
        }
        for (own, other) in [(a, b), (b, a)] {
            if farthest[own].is_none_or(|(known, _)| border.path_m > known) {
                farthest[own] = Some((border.path_m, other));
            }
        }
    }
    let goes_on = |cell: &GridCell| at.contains_key(cell) || laid.dropped.contains(cell);
    for (point, &cell) in laid.cells.iter().enumerate() {
        let is_large = divided.cells.areas[point] > MOST * MOST * lattice.cell_m2();
        if is_large
            && lattice.around(cell).iter().all(goes_on)
            && let Some((distance_m, other)) = farthest[point]
        {
            take(point, other, distance_m.max(MOST * pitch_m));
        }
    }
    worst
}
