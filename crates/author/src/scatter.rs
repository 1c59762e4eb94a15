//! Random samples on triangles, uniform or by a density.

use glam::DVec3;

use super::placed::{Placed, SurfacePoint};
use super::random::Random;
use crate::body::area_vector;
use crate::error::{Error, Result, failed};

/// The most points that are placed at a time.
pub(super) const MAX_POINTS: f64 = 4e6;

/// Maximum number of subdivisions of a triangle.
const MAX_CUTS: u32 = 12;

/// A triangle's own corners in its barycentric coordinates.
const CORNERS: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A part of a triangle with constant density.
#[derive(Clone, Copy)]
struct Piece {
    triangle: u32,
    /// Its corners in the triangle's barycentric coordinates.
    within: [[f64; 3]; 3],
    density: f64,
    cuts: u32,
}

/// A surface in pieces, sampled in proportion to area times density.
pub(super) struct Pieces {
    corners: Vec<[DVec3; 3]>,
    pieces: Vec<Piece>,
    /// Sum of area times density, m², up to and with each piece.
    weight_up_to: Vec<f64>,
}

fn area_of(corners: [DVec3; 3]) -> f64 {
    area_vector(corners).length() / 2.0
}

fn at([a, b, c]: [DVec3; 3], weights: [f64; 3]) -> DVec3 {
    a * weights[0] + b * weights[1] + c * weights[2]
}

fn corners(positions: &[DVec3], triangles: &[[u32; 3]]) -> Result<Vec<[DVec3; 3]>> {
    let corner = |v: u32| positions.get(v as usize).copied();
    triangles
        .iter()
        .enumerate()
        .map(|(index, &[a, b, c])| match (corner(a), corner(b), corner(c)) {
            (Some(a), Some(b), Some(c)) => Ok([a, b, c]),
            _ => Err(failed!("triangle {index} names a vertex that is not there")),
        })
        .collect()
}

impl Pieces {
    /// Each triangle a piece, all of density 1.
    pub(super) fn whole(positions: &[DVec3], triangles: &[[u32; 3]]) -> Result<Self> {
        let corners = corners(positions, triangles)?;
        let piece = |triangle| Piece { triangle, within: CORNERS, density: 1.0, cuts: 0 };
        let pieces = (0..corners.len() as u32).map(piece).collect();
        Self::new(corners, pieces, "the surface has no area to place taxels on")
    }

    /// Triangles subdivided until each piece gets few of `count` samples; `density` is evaluated at the pieces' middles.
    pub(super) fn by_density(
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        count: usize,
        density: impl Fn(&Placed) -> f64,
    ) -> Result<Self> {
        let whole = Self::whole(positions, triangles)?;
        let corners = whole.corners;
        let mut evaluated = |mut piece: Piece| -> Result<(Piece, f64)> {
            let triangle = corners[piece.triangle as usize];
            let own = piece.within.map(|corner| at(triangle, corner));
            let middle = SurfacePoint {
                position: (own[0] + own[1] + own[2]) / 3.0,
                normal: area_vector(triangle).normalize_or_zero(),
                area: area_of(own),
            };
            let [p, q, r] = piece.within;
            let barycentric = std::array::from_fn(|k| (p[k] + q[k] + r[k]) / 3.0);
            piece.density = density(&Placed { point: middle, triangle: piece.triangle as usize, barycentric });
            if !(piece.density.is_finite() && piece.density >= 0.0) {
                return Err(failed!(
                    "the density of taxels is {} at {}; it should be a number from 0 up",
                    piece.density,
                    middle.position
                ));
            }
            Ok((piece, middle.area))
        };
        let first: Vec<(Piece, f64)> = whole.pieces.into_iter().map(&mut evaluated).collect::<Result<_>>()?;
        let (area, weight) = first.iter().fold((0.0, 0.0), |(a, w), (p, area)| (a + area, w + area * p.density));
        let (most_area, most_weight) = (4.0 * area / count as f64, 2.0 * weight / count as f64);
        let mut pieces = Vec::with_capacity(first.len());
        let mut open: Vec<(Piece, f64)> = first.into_iter().rev().collect();
        while let Some((piece, area)) = open.pop() {
            let fine = area <= most_area && area * piece.density <= most_weight.max(f64::MIN_POSITIVE);
            if fine || piece.cuts == MAX_CUTS {
                pieces.push(piece);
                continue;
            }
            for within in quarters(piece.within) {
                open.push(evaluated(Piece { within, cuts: piece.cuts + 1, ..piece })?);
            }
        }
        Self::new(corners, pieces, "the density of taxels is 0 everywhere on the surface")
    }

    fn new(corners: Vec<[DVec3; 3]>, pieces: Vec<Piece>, why_empty: &str) -> Result<Self> {
        let mut weight = 0.0;
        let weight_up_to = pieces
            .iter()
            .map(|piece| {
                let triangle = corners[piece.triangle as usize];
                weight += match piece.cuts {
                    0 => area_of(triangle),
                    _ => area_of(piece.within.map(|corner| at(triangle, corner))),
                } * piece.density;
                weight
            })
            .collect();
        if !(weight.is_finite() && weight > 0.0) {
            return Err(Error::failed(why_empty));
        }
        Ok(Self { corners, pieces, weight_up_to })
    }

    pub(super) fn weight(&self) -> f64 {
        self.weight_up_to.last().copied().unwrap_or(0.0)
    }

    /// Draws `count` samples, each with its share of the area.
    pub(super) fn scatter(&self, count: usize, seed: u64) -> Vec<Placed> {
        let mut random = Random::new(seed);
        let weight = self.weight();
        let share = weight / count as f64;
        let mut index = 0;
        (0..count)
            .map(|sample| {
                // One sample in each of `count` equal shares: uniform, with fewer gaps.
                let place = weight * (sample as f64 + random.unit()) / count as f64;
                while index + 1 < self.pieces.len() && self.weight_up_to[index] <= place {
                    index += 1;
                }
                let piece = &self.pieces[index];
                let triangle = self.corners[piece.triangle as usize];
                let (root, along) = (random.unit().sqrt(), random.unit());
                let within = [1.0 - root, root * (1.0 - along), root * along];
                let barycentric = match piece.cuts {
                    0 => within,
                    _ => {
                        let [p, q, r] = piece.within;
                        std::array::from_fn(|k| p[k] * within[0] + q[k] * within[1] + r[k] * within[2])
                    }
                };
                let position = at(triangle, barycentric);
                let point = SurfacePoint {
                    position,
                    normal: area_vector(triangle).normalize_or_zero(),
                    area: share / piece.density,
                };
                Placed { point, triangle: piece.triangle as usize, barycentric }
            })
            .collect()
    }
}

/// A triangle cut at the middles of its edges.
fn quarters([a, b, c]: [[f64; 3]; 3]) -> [[[f64; 3]; 3]; 4] {
    let middle = |p: [f64; 3], q: [f64; 3]| std::array::from_fn(|k| (p[k] + q[k]) / 2.0);
    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

/// How many points fit `spacing_m` apart on `area_m2`, if that can be placed.
pub(super) fn most_apart(area_m2: f64, spacing_m: f64) -> Result<f64> {
    if !(spacing_m.is_finite() && spacing_m > 0.0) {
        return Err(failed!("taxels cannot lie {spacing_m} m apart; give a spacing over 0"));
    }
    let most = area_m2 * 2.0 / (3.0_f64.sqrt() * spacing_m * spacing_m);
    if most > MAX_POINTS {
        return Err(failed!(
            "about {most:.1e} taxels {spacing_m} m apart would fit, over the {MAX_POINTS:.0e} that can be placed; is the \
             spacing in metres?"
        ));
    }
    Ok(most)
}
