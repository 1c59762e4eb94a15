//! The surface of a place in samples: which of it may get taxels.

use std::collections::BTreeMap;

use glam::DVec3;

use super::borders::Borders;
use super::lint::{BodyPoint, Touchable};
use super::mirror::Mirror;
use super::place::widest_radius;
use super::placed::{Placed, Progress, SurfacePoint, points_on_same_side};
use super::rest_surface::RestSurface;
use super::scatter::Pieces;
use crate::body::{PointTree, area_vector, point_tree};
use crate::error::{Error, Result};

/// Samples for each taxel, and limits of their number.
const PER_TAXEL: usize = 16;
const MIN_SAMPLES: usize = 4_000;
const MAX_SAMPLES: usize = 24_000;
const LEAST_PER_TAXEL: usize = 2;
const MOST_SAMPLES: usize = 400_000;

/// Where less than this share of a surface is open, rays start inside it: its faces look inward.
const MIN_OPEN_SHARE: f64 = 0.005;

/// Nearest samples that are looked through for one on the same side.
const MAX_CANDIDATES: usize = 16;

/// A taxel beside another is nearer to it than this share of what is usual.
const BESIDE: f64 = 0.5;

/// Where more than this share of a surface has no mirror image, its halves are not alike.
const MAX_ALONE_SHARE: f64 = 0.01;

/// So far around a taxel nothing stands before it, m: more than a file's 32 bits round, and much less than rays start outside.
const AROUND_M: f64 = 1e-6;

const SEED: u64 = 0x6e0d;

/// Why a point gets no taxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Open,
    Hidden,
    /// It is too near to a border.
    Rim,
    /// It has no mirror image.
    Alone,
}

/// What says which points may get taxels.
pub(super) struct Rules<'a> {
    pub(super) rest_surface: &'a RestSurface<'a>,
    /// The triangles of the place, as those of the whole surface.
    pub(super) chosen: &'a [usize],
    /// What stands before the surface, if hidden points are left out.
    pub(super) touchable: Option<&'a Touchable<'a>>,
    pub(super) borders: Option<Borders>,
    /// What finds mirror images, if points without one are left out; for those with one, the image is in the same state.
    pub(super) mirror: Option<&'a Mirror<'a>>,
}

impl Rules<'_> {
    /// Whether they leave any point out.
    pub(super) fn are_any(&self) -> bool {
        self.touchable.is_some() || self.borders.is_some() || self.mirror.is_some()
    }

    /// The taxels of `placed` that the rules leave.
    pub(super) fn without_closed(&self, placed: Vec<Placed>, progress: Progress<'_>) -> Result<Vec<Placed>> {
        let states = self.states(&placed, progress)?;
        Ok(placed.into_iter().zip(states).filter(|(_, state)| *state == State::Open).map(|(one, _)| one).collect())
    }

    /// The states of places where taxels stay. At the foot of a wall or on a rim, which taxels go to as they are relaxed, rays start
    /// exactly on a surface, and rounding says on which side: there the points around must be open as well.
    fn states_of_final(&self, placed: &[Placed], progress: Progress<'_>) -> Result<Vec<State>> {
        let mut states = self.states(placed, &mut |share| progress(0.5 * share))?;
        if self.touchable.is_none() {
            return Ok(states);
        }
        let around = placed.iter().flat_map(|one| {
            let point = self.body_point(one);
            let (u, v) = point.normal.any_orthonormal_pair();
            [u, -u, v, -v].map(|way| BodyPoint { position: point.position + AROUND_M * way, ..point })
        });
        let around = self.states_of(&around.collect::<Vec<_>>(), &mut |share| progress(0.5 + 0.5 * share))?;
        for (state, around) in states.iter_mut().zip(around.chunks(4)) {
            if *state == State::Open && around.contains(&State::Hidden) {
                *state = State::Hidden;
            }
        }
        Ok(states)
    }

    fn states(&self, placed: &[Placed], progress: Progress<'_>) -> Result<Vec<State>> {
        let points: Vec<BodyPoint> = placed.iter().map(|one| self.body_point(one)).collect();
        let Some(mirror) = self.mirror else { return self.states_of(&points, progress) };
        let mut states = self.states_of(&points, &mut |share| progress(0.5 * share))?;
        let (mut images, mut of_image) = (Vec::new(), Vec::new());
        for (index, (state, point)) in states.iter_mut().zip(&points).enumerate() {
            if *state != State::Open {
                continue;
            }
            match mirror.image(point.link, point.position, point.normal) {
                Ok(image) => {
                    let (link, SurfacePoint { position, normal, .. }) = (mirror.link_of(&image), image.point);
                    images.push(BodyPoint { link, position, normal });
                    of_image.push(index);
                }
                Err(_) => *state = State::Alone,
            }
        }
        let image_states = self.states_of(&images, &mut |share| progress(0.5 + 0.5 * share))?;
        of_image.into_iter().zip(image_states).for_each(|(index, state)| states[index] = state);
        Ok(states)
    }

    fn body_point(&self, one: &Placed) -> BodyPoint {
        let SurfacePoint { position, normal, .. } = one.point;
        BodyPoint { link: self.rest_surface.link[self.chosen[one.triangle]] as usize, position, normal }
    }

    /// The states of `points`, whatever their images are.
    fn states_of(&self, points: &[BodyPoint], progress: Progress<'_>) -> Result<Vec<State>> {
        let mut states = vec![State::Open; points.len()];
        if let Some(touchable) = self.touchable {
            let stopped = || Error::failed("stopped before all taxels were placed");
            let open = touchable.are_open(points, progress).ok_or_else(stopped)?;
            states.iter_mut().zip(open).filter(|(_, open)| !open).for_each(|(state, _)| *state = State::Hidden);
        }
        if let Some(borders) = &self.borders {
            for (state, point) in states.iter_mut().zip(points).filter(|(state, _)| **state == State::Open) {
                if !borders.are_clear_of(point.position) {
                    *state = State::Rim;
                }
            }
        }
        Ok(states)
    }
}

/// A surface in samples of equal area, each with whether it may get taxels.
pub(super) struct Ground<'a> {
    rules: Rules<'a>,
    samples: Vec<Placed>,
    states: Vec<State>,
    tree: PointTree,
    /// The area of a sample, m².
    each_m2: f64,
    /// Whether rays tell nothing, as faces look inward.
    is_inside_out: bool,
    /// Whether all points may get taxels.
    is_all: bool,
}

impl<'a> Ground<'a> {
    /// The surface `triangles` over `positions`, for `count` taxels by `rules`.
    pub(super) fn new(
        rules: Rules<'a>,
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        count: usize,
        progress: Progress<'_>,
    ) -> Result<Self> {
        let pieces = Pieces::whole(positions, triangles)?;
        let many = (PER_TAXEL * count).clamp(MIN_SAMPLES, MAX_SAMPLES).max((LEAST_PER_TAXEL * count).min(MOST_SAMPLES));
        let samples = if rules.are_any() { pieces.scatter(many, SEED) } else { Vec::new() };
        let mut states = rules.states(&samples, progress)?;
        let hidden = states.iter().filter(|state| **state == State::Hidden).count();
        let is_inside_out = hidden as f64 > (1.0 - MIN_OPEN_SHARE) * samples.len() as f64 && hidden > 0;
        let mut rules = rules;
        if is_inside_out {
            rules.touchable = None;
            states = rules.states(&samples, progress)?;
        }
        let is_alone = |(_, state): &(&Placed, &State)| **state == State::Alone;
        let alone = samples.iter().zip(&states).filter(is_alone).map(|(sample, _)| rules.body_point(sample));
        let alone: Vec<_> = alone.map(|point| (point.link, point.position, point.normal)).collect();
        let share = alone.len() as f64 / samples.len().max(1) as f64;
        if let Some(mirror) = rules.mirror.filter(|_| share > MAX_ALONE_SHARE) {
            return Err(mirror.refusal(&alone, share));
        }
        if !samples.is_empty() && !states.contains(&State::Open) {
            return Err(Error::failed(
                "no surface is left that far from the borders of links and seams; ask for a smaller `clear`",
            ));
        }
        let tree = point_tree(samples.iter().map(|sample| sample.point.position));
        let each_m2 = pieces.weight() / many as f64;
        let is_all = states.iter().all(|state| *state == State::Open);
        Ok(Self { rules, samples, states, tree, each_m2, is_inside_out, is_all })
    }

    /// Whether all points may get taxels.
    pub(super) fn is_all(&self) -> bool {
        self.is_all
    }

    pub(super) fn is_inside_out(&self) -> bool {
        self.is_inside_out
    }

    /// Whether the sample nearest to `position`, of those that face about as `normal` does, may get a taxel.
    pub(super) fn is_open(&self, position: DVec3, normal: DVec3) -> bool {
        self.nearest(position, normal).is_none_or(|sample| self.states[sample] == State::Open)
    }

    fn nearest(&self, position: DVec3, normal: DVec3) -> Option<usize> {
        let near = || self.tree.nearest_neighbor_iter(position.to_array()).map(|spot| spot.data);
        let facing = near().take(MAX_CANDIDATES).find(|&sample| self.samples[sample].point.normal.dot(normal) > 0.0);
        facing.or_else(|| near().next())
    }

    /// The samples that may get taxels.
    pub(super) fn open(&self) -> impl Iterator<Item = &Placed> {
        self.samples.iter().zip(&self.states).filter(|(_, state)| **state == State::Open).map(|(sample, _)| sample)
    }

    /// The area of a sample, m².
    pub(super) fn each_m2(&self) -> f64 {
        self.each_m2
    }

    /// Per link its hidden area, m², if it has any.
    pub(super) fn hidden_m2(&self) -> BTreeMap<usize, f64> {
        self.area_m2(State::Hidden)
    }

    /// Per link its area without a mirror image, m², if it has any.
    pub(super) fn alone_m2(&self) -> BTreeMap<usize, f64> {
        self.area_m2(State::Alone)
    }

    fn area_m2(&self, wanted: State) -> BTreeMap<usize, f64> {
        let mut area_m2 = BTreeMap::new();
        for (sample, _) in self.samples.iter().zip(&self.states).filter(|(_, state)| **state == wanted) {
            *area_m2.entry(self.rules.body_point(sample).link).or_insert(0.0) += self.each_m2;
        }
        area_m2
    }

    pub(super) fn rules(&self) -> &Rules<'a> {
        &self.rules
    }

    /// Per triangle of `triangles` over `positions` whether it is skin: most of it may get taxels, or is only too near to a border.
    pub(super) fn skin(&self, positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<bool> {
        if !self.states.contains(&State::Hidden) {
            return vec![true; triangles.len()];
        }
        let is_hidden = |sample: usize| self.states[sample] == State::Hidden;
        let mut counts = vec![[0_u32; 2]; triangles.len()];
        for (sample, one) in self.samples.iter().enumerate() {
            counts[one.triangle][usize::from(is_hidden(sample))] += 1;
        }
        let nearest = |corners: &[u32; 3]| {
            let corners = corners.map(|v| positions[v as usize]);
            let normal = area_vector(corners).normalize_or_zero();
            self.nearest(corners.iter().sum::<DVec3>() / 3.0, normal).is_none_or(|sample| !is_hidden(sample))
        };
        let is_skin = |(corners, [open, hidden]): (&[u32; 3], [u32; 2])| match open + hidden {
            0 => nearest(corners),
            _ => open >= hidden,
        };
        triangles.iter().zip(counts).map(is_skin).collect()
    }

    /// `placed`, with taxels moved that may not be where they are: each to the nearest open sample of its cell that is not beside
    /// another taxel, else to the nearest of its cell, else to the nearest of all.
    pub(super) fn settled(&self, mut placed: Vec<Placed>, progress: Progress<'_>) -> Result<Vec<Placed>> {
        let states = self.rules.states_of_final(&placed, progress)?;
        if states.iter().all(|state| *state == State::Open) {
            return Ok(placed);
        }
        let tree = point_tree(placed.iter().map(|one| one.point.position));
        let mut is_taken = vec![false; self.samples.len()];
        let beside_m = BESIDE * 2.0 * widest_radius(self.open().count() as f64 * self.each_m2, placed.len());
        let mut moves = Vec::new();
        for (index, _) in states.iter().enumerate().filter(|(_, state)| **state != State::Open) {
            let here = placed[index].point;
            let near = self.tree.nearest_neighbor_iter(here.position.to_array()).map(|spot| spot.data);
            let is_free = |sample: &usize| self.states[*sample] == State::Open && !is_taken[*sample];
            let open: Vec<usize> = near.filter(is_free).take(8 * MAX_CANDIDATES).collect();
            // The taxels around a sample, the nearest first, without the one that moves.
            let others = |sample: usize| {
                let at = self.samples[sample].point.position.to_array();
                let near = tree.nearest_neighbor_iter_with_distance_2(at).filter(|(spot, _)| spot.data != index);
                near.map(|(_, squared)| squared.sqrt()).next().unwrap_or(f64::INFINITY)
            };
            let is_of_cell = |sample: &&usize| {
                let point = &self.samples[**sample].point;
                points_on_same_side(point, &here) && others(**sample) > point.position.distance(here.position)
            };
            let is_alone = |sample: &&usize| others(**sample) > beside_m;
            let own = open.iter().find(|sample| is_of_cell(sample) && is_alone(sample));
            let own = own.or_else(|| open.iter().find(is_of_cell)).or_else(|| open.iter().find(is_alone));
            let Some(&sample) = own.or(open.first()) else { continue };
            is_taken[sample] = true;
            moves.push((index, sample));
        }
        for (index, sample) in moves {
            placed[index] = self.samples[sample];
            placed[index].point.area = 0.0;
        }
        placed.sort_by_key(|one| one.triangle);
        Ok(placed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Glb, MeshData, Original};
    use crate::lint::DrawnPoses;

    /// A floor of 0.2 m by 0.2 m, on which a box stands where x > 0, so thin that the floor ends at its wall.
    fn floor_and_box() -> Original {
        let (mut floor, mut walls) = (MeshData::default(), MeshData::default());
        let quad = |mesh: &mut MeshData, corners: [[f32; 3]; 4], normal: [f32; 3]| {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(corners);
            mesh.normals.extend([normal; 4]);
            mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        };
        quad(&mut floor, [[-0.2, 0.0, -0.1], [-0.2, 0.0, 0.1], [0.0, 0.0, 0.1], [0.0, 0.0, -0.1]], [0.0, 1.0, 0.0]);
        let (low, high) = ([0.0, -0.1, -0.2], [0.1, 0.3, 0.2]);
        for axis in 0..3 {
            for side in 0..2 {
                let corner = |u: usize, v: usize| {
                    let mut at = [0.0; 3];
                    at[axis] = [low, high][side][axis];
                    at[(axis + 1) % 3] = [low, high][u][(axis + 1) % 3];
                    at[(axis + 2) % 3] = [low, high][v][(axis + 2) % 3];
                    at
                };
                let mut corners = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                let mut normal = [0.0; 3];
                normal[axis] = [-1.0, 1.0][side];
                if side == 0 {
                    corners.reverse();
                }
                quad(&mut walls, corners, normal);
            }
        }
        let mut glb = Glb::new();
        for (name, mesh) in [("floor", floor), ("box", walls)] {
            let link = glb.node(name, None, DVec3::ZERO);
            glb.mesh(link, name, &mesh, None, None);
        }
        Original::from_bytes("corner", &glb.to_bytes().unwrap(), None).unwrap()
    }

    #[test]
    fn a_taxel_at_the_foot_of_a_wall_moves_away_from_it_whatever_rounding_says() {
        let (body, details) = floor_and_box().read().unwrap();
        let rest_surface = RestSurface::new(&body, &details);
        let drawn = DrawnPoses::from_body(&body);
        let touchable = Touchable::new(&body, &drawn);
        let chosen: Vec<usize> = (0..rest_surface.triangles.len()).collect();
        let rules = Rules {
            rest_surface: &rest_surface,
            chosen: &chosen,
            touchable: Some(&touchable),
            borders: None,
            mirror: None,
        };
        let (positions, triangles) = (&rest_surface.positions, &rest_surface.triangles);
        let ground = Ground::new(rules, positions, triangles, 100, &mut |_| true).unwrap();
        for x in [-1e-11, 0.0, 1e-11, -0.01] {
            let point = SurfacePoint { position: DVec3::new(x, 0.0, 0.01), normal: DVec3::Y, area: 0.0 };
            let placed = vec![Placed { point, triangle: 1, barycentric: [0.0; 3] }];
            let settled = ground.settled(placed, &mut |_| true).unwrap()[0];
            let has_moved = settled.point.position != point.position;
            assert_eq!(has_moved, x > -0.001, "{x}: {settled:?}");
            // Onto the floor, or up the wall.
            assert!(settled.point.position.with_z(0.0).length() > AROUND_M, "{x}: {settled:?}");
        }
    }
}
