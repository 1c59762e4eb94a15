//! The pressure under an indenter on a curved surface, and what the layer makes of it.

use std::collections::{BTreeMap, HashMap};

use glam::DVec3;

use super::cells::Cells;
use super::chart;
use super::indenter::Placed;
use super::layer::Layer;
use super::pieces::{middle, pieces};
use super::surface::{Piece, Tile, WholeSurface};

/// Pieces that an indenter presses, at least: as many as give its force to a hundredth, and its place far better.
const ENOUGH: usize = 2000;
/// Edges of the pieces that an indenter presses, at least, m.
const MIN_EDGE_M: f64 = 3e-5;
/// Attempts at pieces of the right size.
const ATTEMPTS: u32 = 10;
/// Forces are put together in larger cubes until there are at most this many.
const MANY: usize = 4000;

/// The surface that a touch presses, and the layer over it.
pub(super) struct Skin<'a> {
    pub(super) surface: &'a WholeSurface,
    pub(super) cells: &'a Cells,
    pub(super) layer: &'a Layer,
}

/// A piece under an indenter.
#[derive(Clone, Copy)]
struct Pressed {
    facet: usize,
    middle: DVec3,
    area_m2: f64,
    /// Of a strap's depth the share that is here.
    bulge: f64,
}

/// A force on the outside of the layer.
#[derive(Clone, Copy)]
pub(super) struct Load {
    pub(super) position: DVec3,
    pub(super) normal: DVec3,
    pub(super) force_newton: f64,
    /// The connected part of the pressed surface that it is on.
    pub(super) part: u32,
    /// The integral of [`Layer::share_at`] over that part, m².
    pub(super) spread_m2: f64,
}

/// A piece under the layer, and the force on it.
#[derive(Clone, Copy)]
pub(super) struct Felt {
    pub(super) piece: Piece,
    pub(super) facet: usize,
    pub(super) force_newton: f64,
}

/// What an indenter does.
pub(super) struct Pressure {
    /// How far its lowest point is under the surface, m.
    pub(super) depth_m: f64,
    pub(super) loads: Vec<Load>,
    pub(super) felt: Vec<Felt>,
    /// Per facet that pressure may reach its connected part.
    pub(super) parts: BTreeMap<usize, u32>,
}

impl Skin<'_> {
    /// The pressure of `placed`, pressed with `force_newton`.
    pub(super) fn press(&self, placed: &Placed, force_newton: f64) -> Pressure {
        let (depth_m, pressed) = self.contact(placed, force_newton);
        let cubes = self.cubes(&pressed);
        let facets = pressed.iter().map(|(piece, _)| piece.facet);
        let (parts, tiles) = reached(self.surface, facets, &cubes, self.layer.reach_m());
        let mut loads = self.loads(&pressed, &parts);
        let felt = self.spread(&mut loads, &tiles, &parts);
        Pressure { depth_m, loads, felt, parts }
    }

    /// How deep the indenter is, and the pieces under it with the force on each.
    fn contact(&self, placed: &Placed, force_newton: f64) -> (f64, Vec<(Pressed, f64)>) {
        let (deepest_m, highest_m) = (placed.shape.deepest_m(), placed.shape.highest_m());
        let mut range = [0.0, deepest_m];
        let mut edge_m = (placed.shape.size_m() / 4.0).min(self.layer.piece_m());
        // Whether the depth is in the range; if not, that grows.
        let fits = |depth_m: f64, range: &mut [f64; 2]| {
            if depth_m >= range[1] && range[1] < deepest_m {
                range[1] = (range[1] + 2.0 * (range[1] - range[0])).min(deepest_m);
            } else if depth_m <= range[0] && range[0] > -highest_m {
                range[0] = -highest_m;
            } else {
                return true;
            }
            false
        };
        let mut found = Vec::new();
        for _ in 0..ATTEMPTS {
            found = self.under(placed, range, edge_m);
            let depth_m = self.depth(placed, &found, force_newton, range);
            if !fits(depth_m, &mut range) {
                continue;
            }
            let pressed = found.iter().filter(|piece| self.depth_at(placed, depth_m, piece) > 0.0).count();
            if pressed >= ENOUGH || edge_m <= MIN_EDGE_M {
                break;
            }
            edge_m = (edge_m * (pressed.max(50) as f64 / (1.3 * ENOUGH as f64)).sqrt()).max(MIN_EDGE_M);
            let margin = (depth_m.abs() / 2.0).max(edge_m / 2.0);
            range = [
                if depth_m < 0.0 { (depth_m - margin).max(-highest_m) } else { 0.0 },
                (depth_m + margin).min(deepest_m),
            ];
        }
        // What other parts cover bears nothing, and the indenter sinks the deeper.
        let depth_m = loop {
            found.retain(|piece| {
                // A strap is as wide at any depth.
                placed.may_hold(range[0], range[1], piece.middle, 0.0)
                    && !self.surface.is_covered(piece.middle, self.normal(piece))
            });
            let depth_m = self.depth(placed, &found, force_newton, range);
            if fits(depth_m, &mut range) {
                break depth_m;
            }
            found = self.under(placed, range, edge_m);
        };
        let volumes: Vec<f64> =
            found.iter().map(|piece| self.depth_at(placed, depth_m, piece) * piece.area_m2).collect();
        let whole: f64 = volumes.iter().sum();
        if whole > 0.0 {
            let forces = volumes.into_iter().map(|part| force_newton * (part / whole));
            let pressed = found.into_iter().zip(forces).filter(|(_, force)| *force > 0.0).collect();
            return (depth_m, pressed);
        }
        // It is smaller than any piece.
        let spot = &placed.pose.spot;
        let piece = Pressed { facet: spot.facet, middle: spot.position, area_m2: 0.0, bulge: 0.0 };
        (depth_m, vec![(piece, force_newton)])
    }

    /// How deep the indenter is under `piece`.
    fn depth_at(&self, placed: &Placed, depth_m: f64, piece: &Pressed) -> f64 {
        placed.depth_at(depth_m, piece.middle, self.normal(piece), piece.bulge)
    }

    fn normal(&self, piece: &Pressed) -> DVec3 {
        self.surface.facet(piece.facet).normal
    }

    /// The pieces with edges of at most `edge_m` that the indenter may press at a depth from `from_m` to `to_m`.
    fn under(&self, placed: &Placed, [from_m, to_m]: [f64; 2], edge_m: f64) -> Vec<Pressed> {
        let around = placed.around(from_m, to_m);
        let mut facets: Vec<usize> =
            around.iter().flat_map(|&(p, within_m)| self.surface.around(p, within_m)).collect();
        facets.sort_unstable();
        facets.dedup();
        let mut found = Vec::new();
        for index in facets {
            let facet = self.surface.facet(index);
            let may_hold = |p: DVec3, radius: f64| placed.may_hold(from_m, to_m, p, radius);
            for corners in placed.between_ends(facet.corners) {
                pieces(corners, edge_m, may_hold, |corners, area_m2| {
                    let middle = middle(corners);
                    if let Some(bulge) = placed.presses(middle, facet.normal) {
                        found.push(Pressed { facet: index, middle, area_m2, bulge });
                    }
                });
            }
        }
        found
    }

    /// The depth from `from_m` to `to_m` at which the layer presses back with `force_newton`, or the end nearest to it.
    fn depth(&self, placed: &Placed, pieces: &[Pressed], force_newton: f64, [from_m, to_m]: [f64; 2]) -> f64 {
        let beyond = |depth_m: f64| {
            let depths = pieces.iter().map(|piece| self.depth_at(placed, depth_m, piece) * piece.area_m2);
            self.layer.stiffness_pa_m * depths.sum::<f64>() - force_newton
        };
        let (mut low, mut high) = ((from_m, beyond(from_m)), (to_m, beyond(to_m)));
        if low.1 >= 0.0 || high.1 <= 0.0 {
            return if high.1 <= 0.0 { to_m } else { from_m };
        }
        // Regula falsi, with the end that stays counting half (Illinois).
        let mut stayed = 0;
        for _ in 0..100 {
            let depth_m = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let force = beyond(depth_m);
            if force.abs() <= 1e-9 * force_newton || high.0 - low.0 <= 1e-12 {
                return depth_m;
            }
            if force < 0.0 {
                low = (depth_m, force);
                high.1 *= if stayed == 1 { 0.5 } else { 1.0 };
                stayed = 1;
            } else {
                high = (depth_m, force);
                low.1 *= if stayed == -1 { 0.5 } else { 1.0 };
                stayed = -1;
            }
        }
        (low.0 + high.0) / 2.0
    }

    /// The middles of forces that lie in the same cube.
    fn cubes(&self, pressed: &[(Pressed, f64)]) -> Vec<DVec3> {
        let mut cube_m = self.layer.cube_m();
        loop {
            let mut cubes: BTreeMap<[i64; 3], (f64, DVec3)> = BTreeMap::new();
            for (piece, force) in pressed {
                let sum = cubes.entry(cube(piece.middle, cube_m)).or_default();
                *sum = (sum.0 + force, sum.1 + piece.middle * *force);
            }
            if cubes.len() <= MANY || cube_m >= 2.0 * self.layer.cube_m() {
                return cubes.into_values().map(|(force, moment)| moment / force).collect();
            }
            cube_m *= 1.25;
        }
    }

    /// The forces of `pressed`, those in a cube and part put together.
    fn loads(&self, pressed: &[(Pressed, f64)], parts: &BTreeMap<usize, u32>) -> Vec<Load> {
        let mut cube_m = self.layer.cube_m();
        loop {
            let mut cubes: BTreeMap<(u32, [i64; 3]), (f64, DVec3, DVec3)> = BTreeMap::new();
            for (piece, force) in pressed {
                let part = parts.get(&piece.facet).copied().unwrap_or(u32::MAX);
                let sum = cubes.entry((part, cube(piece.middle, cube_m))).or_default();
                let normal = self.normal(piece) * *force;
                *sum = (sum.0 + force, sum.1 + piece.middle * *force, sum.2 + normal);
            }
            if cubes.len() <= MANY || cube_m >= 2.0 * self.layer.cube_m() {
                let load = |((part, _), (force_newton, moment, normal)): ((u32, _), (f64, DVec3, DVec3))| Load {
                    position: moment / force_newton,
                    normal: normal.normalize_or(DVec3::Z),
                    force_newton,
                    part,
                    spread_m2: 0.0,
                };
                return cubes.into_iter().map(load).collect();
            }
            cube_m *= 1.25;
        }
    }

    /// The force on each piece within reach of `loads`, which learn how far they spread. All of a force arrives.
    fn spread(&self, loads: &mut [Load], tiles: &[(usize, &Tile)], parts: &BTreeMap<usize, u32>) -> Vec<Felt> {
        let reach_m = self.layer.reach_m();
        let mut felt: Vec<Felt> = Vec::new();
        let mut by_cube: HashMap<(u32, [i64; 3]), Vec<u32>> = HashMap::new();
        for &(facet, tile) in tiles {
            for piece in self.surface.pieces(facet, tile, self.cells) {
                let place = (parts[&facet], cube(piece.middle, reach_m));
                by_cube.entry(place).or_default().push(felt.len() as u32);
                felt.push(Felt { piece: *piece, facet, force_newton: 0.0 });
            }
        }
        let mut shares: Vec<(u32, f64)> = Vec::new();
        for load in loads {
            shares.clear();
            let mut sum = 0.0;
            let [x, y, z] = cube(load.position, reach_m);
            for (i, j, k) in (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| (i, j, k)))) {
                for &index in by_cube.get(&(load.part, [x + i, y + j, z + k])).into_iter().flatten() {
                    let Felt { piece, facet, .. } = &felt[index as usize];
                    let offset = piece.middle - load.position;
                    if offset.length_squared() > reach_m * reach_m {
                        continue;
                    }
                    let share = piece.area_m2 * self.share(load, offset, self.surface.facet(*facet).normal);
                    if share > 0.0 {
                        sum += share;
                        shares.push((index, share));
                    }
                }
            }
            load.spread_m2 = sum;
            if sum > 0.0 {
                for &(index, share) in &shares {
                    felt[index as usize].force_newton += load.force_newton * (share / sum);
                }
            }
        }
        felt.retain(|felt| felt.force_newton > 0.0);
        felt
    }

    /// The pressure of `load` at `offset` from it, where the normal is `normal`, as a share of that below it.
    pub(super) fn share(&self, load: &Load, offset: DVec3, normal: DVec3) -> f64 {
        if !chart::is_beside(load.normal, normal) {
            return 0.0;
        }
        self.layer.share_at(chart::distance(offset, load.normal, normal))
    }
}

/// Per facet that pressure may reach its connected part, and the tiles of those facets that it may reach: within `reach_m` of
/// points of `near`, and connected to one of `pressed`. A part is what hangs together there.
pub(super) fn reached<'s>(
    surface: &'s WholeSurface,
    pressed: impl IntoIterator<Item = usize>,
    near: &[DVec3],
    reach_m: f64,
) -> (BTreeMap<usize, u32>, Vec<(usize, &'s Tile)>) {
    let ends = near.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), &p| (l.min(p), h.max(p)));
    let is_reached = |tile: &&Tile| {
        let within = reach_m + tile.radius_m;
        tile.middle.distance_squared(tile.middle.clamp(ends.0, ends.1)) <= within * within
            && near.iter().any(|p| p.distance_squared(tile.middle) <= within * within)
    };
    let (mut parts, mut tiles, mut next) = (BTreeMap::new(), Vec::new(), 0);
    for facet in pressed {
        let mut open = vec![facet];
        let known = parts.len();
        while let Some(facet) = open.pop() {
            if parts.contains_key(&facet) {
                continue;
            }
            let of_facet = surface.tiles(facet).iter().filter(is_reached).map(|tile| (facet, tile));
            let before = tiles.len();
            tiles.extend(of_facet);
            if tiles.len() > before {
                parts.insert(facet, next);
                open.extend(surface.beside(facet));
            }
        }
        next += u32::from(parts.len() > known);
    }
    tiles.sort_by_key(|(facet, _)| *facet);
    (parts, tiles)
}

/// The cube of this size in which `p` lies.
fn cube(p: DVec3, cube_m: f64) -> [i64; 3] {
    (p / cube_m).floor().to_array().map(|steps| steps as i64)
}
