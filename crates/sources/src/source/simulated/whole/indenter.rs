//! What presses on a curved surface, and how deep it is under each point of it.

use glam::DVec3;

use super::chart::{carried, unrolled};
use super::pieces::between;
use super::surface::{Spot, WholeSurface, faces};

/// Distance of the points of a strap's middle line, m.
pub(super) const STEP_M: f64 = 1e-3;
/// A step that advances by less than this share has met the end of the surface.
const LEAST_ADVANCE: f64 = 0.5;
/// A strap's pressure has the same shape at any depth; it is pressed no deeper than this, m.
const MAX_STRAP_DEPTH_M: f64 = 1.0;
/// Of a way, what is left of it at its end by rounding, m.
pub(super) const END_M: f64 = 1e-9;

/// A rigid indenter. Lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::source::simulated) enum Shape {
    Ball {
        radius_m: f64,
    },
    /// Half-axes along it, across it, and along the normal.
    Ellipsoid {
        radii_m: [f64; 3],
    },
    /// A cylinder on its side.
    Rod {
        radius_m: f64,
        length_m: f64,
    },
    /// A band that follows the surface, bulging towards it.
    Strap {
        width_m: f64,
        length_m: f64,
    },
}

/// Where an indenter presses: the point of the surface under its middle, the direction against which it presses, and its own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    pub(super) spot: Spot,
    pub(super) normal: DVec3,
    pub(super) along: DVec3,
}

/// An indenter in its place.
pub(super) struct Placed {
    pub(super) shape: Shape,
    pub(super) pose: Pose,
    /// Of a strap: points of its middle line, and the directions there.
    line: Vec<(Spot, DVec3)>,
}

impl Shape {
    /// Maximum depth, m: beyond it no more of an indenter comes to the surface.
    pub(super) fn deepest_m(&self) -> f64 {
        match *self {
            Self::Ball { radius_m } | Self::Rod { radius_m, .. } => radius_m,
            Self::Ellipsoid { radii_m } => radii_m[2],
            Self::Strap { .. } => MAX_STRAP_DEPTH_M,
        }
    }

    /// Maximum height of its lowest point over the path, m, where other parts of the surface hold it up.
    pub(super) fn highest_m(&self) -> f64 {
        match *self {
            Self::Ball { radius_m } => radius_m,
            Self::Ellipsoid { radii_m: [along, across, deep] } => along.max(across).max(deep),
            Self::Rod { radius_m, length_m } => radius_m + length_m / 2.0,
            Self::Strap { .. } => 0.0,
        }
    }

    /// Whether it has a direction.
    pub(super) fn is_long(&self) -> bool {
        !matches!(self, Self::Ball { .. })
    }

    /// A length that its pieces must be small against, m.
    pub(super) fn size_m(&self) -> f64 {
        match *self {
            Self::Ball { radius_m } | Self::Rod { radius_m, .. } => radius_m,
            Self::Ellipsoid { radii_m } => radii_m[0].min(radii_m[1]),
            Self::Strap { width_m, .. } => width_m / 2.0,
        }
    }
}

impl Placed {
    pub(super) fn new(surface: &WholeSurface, shape: Shape, pose: Pose) -> Self {
        let line = match shape {
            Shape::Strap { length_m, .. } => middle_line(surface, &pose, length_m),
            _ => Vec::new(),
        };
        Self { shape, pose, line }
    }

    /// Its middle when its lowest point is `depth_m` under the surface.
    fn middle(&self, depth_m: f64) -> DVec3 {
        self.pose.spot.position + self.pose.normal * (self.shape.deepest_m() - depth_m)
    }

    /// The triangles that make up the part of that with these corners which lies between its flat ends, if it has such.
    pub(super) fn between_ends(&self, corners: [DVec3; 3]) -> Vec<[DVec3; 3]> {
        let Shape::Rod { length_m, .. } = self.shape else { return vec![corners] };
        // They stay where they are at any depth.
        let middle = self.pose.spot.position.dot(self.pose.along);
        between(corners, self.pose.along, [middle - length_m / 2.0, middle + length_m / 2.0])
    }

    /// Points and a radius around them that hold all of the surface that it may press at depths from `from_m` to `to_m`.
    pub(super) fn around(&self, from_m: f64, to_m: f64) -> Vec<(DVec3, f64)> {
        let (middle, sweep) = (self.middle((from_m + to_m) / 2.0), (to_m - from_m) / 2.0);
        match self.shape {
            Shape::Ball { radius_m } => vec![(middle, radius_m + sweep)],
            Shape::Ellipsoid { radii_m } => vec![(middle, radii_m.into_iter().fold(0.0, f64::max) + sweep)],
            Shape::Rod { radius_m, length_m } => {
                let parts = (length_m / (2.0 * radius_m)).ceil().max(1.0);
                let half = length_m / parts / 2.0;
                let at = |part: f64| middle + self.pose.along * ((2.0 * part + 1.0) * half - length_m / 2.0);
                (0..parts as u32)
                    .map(|part| (at(f64::from(part)), (radius_m * radius_m + half * half).sqrt() + sweep))
                    .collect()
            }
            Shape::Strap { width_m, .. } => {
                self.line.iter().map(|(spot, _)| (spot.position, width_m / 2.0 + STEP_M)).collect()
            }
        }
    }

    /// Whether a point within `within_m` of `p` may lie in it at a depth from `from_m` to `to_m`.
    pub(super) fn may_hold(&self, from_m: f64, to_m: f64, p: DVec3, within_m: f64) -> bool {
        let q = self.local(p - self.middle(to_m));
        // At the depth at which the point is nearest.
        let q = DVec3::new(q.x, q.y, q.z - q.z.clamp(0.0, (to_m - from_m).max(0.0)));
        match self.shape {
            Shape::Ball { radius_m } => q.length() <= radius_m + within_m,
            Shape::Ellipsoid { radii_m } => {
                let least = radii_m.into_iter().fold(f64::INFINITY, f64::min);
                (q / DVec3::from_array(radii_m)).length() <= 1.0 + within_m / least
            }
            Shape::Rod { radius_m, length_m } => {
                q.x.abs() <= length_m / 2.0 + within_m && (q.y * q.y + q.z * q.z).sqrt() <= radius_m + within_m
            }
            Shape::Strap { width_m, .. } => {
                let within = width_m / 2.0 + STEP_M + within_m;
                self.line.iter().any(|(spot, _)| spot.position.distance_squared(p) <= within * within)
            }
        }
    }

    /// `vector` along it, across it and along the normal.
    fn local(&self, vector: DVec3) -> DVec3 {
        let Pose { normal, along, .. } = self.pose;
        DVec3::new(vector.dot(along), vector.dot(normal.cross(along)), vector.dot(normal))
    }

    /// Whether it can press the surface at `p`, whose normal is `normal`: `None`, or the share of a strap's depth that is there.
    pub(super) fn presses(&self, p: DVec3, normal: DVec3) -> Option<f64> {
        let Shape::Strap { width_m, .. } = self.shape else {
            return faces(normal, self.pose.normal).then_some(1.0);
        };
        let halves = 2.0 * self.nearest_of_line(p, normal, width_m)? / width_m;
        (halves < 1.0).then_some(1.0 - halves * halves)
    }

    /// How deep it is under the surface at `p`, along the normal there, when its lowest point is `depth_m` under the surface;
    /// 0 where it does not reach the surface. `bulge` is what [`Placed::presses`] gives there.
    pub(super) fn depth_at(&self, depth_m: f64, p: DVec3, normal: DVec3, bulge: f64) -> f64 {
        // The way inwards until it leaves a body that is round in the coordinates `q`.
        let leaves = |q: DVec3, inwards: DVec3| {
            let (square, across, beyond) = (inwards.length_squared(), q.dot(inwards), q.length_squared() - 1.0);
            if beyond >= 0.0 || square <= 0.0 {
                return if beyond >= 0.0 { 0.0 } else { f64::INFINITY };
            }
            ((across * across - square * beyond).sqrt() - across) / square
        };
        let (q, inwards) = (self.local(p - self.middle(depth_m)), -self.local(normal));
        match self.shape {
            Shape::Ball { radius_m } => leaves(q / radius_m, inwards / radius_m),
            Shape::Ellipsoid { radii_m } => {
                let radii = DVec3::from_array(radii_m);
                leaves(q / radii, inwards / radii)
            }
            Shape::Rod { radius_m, length_m } => {
                let half = length_m / 2.0;
                if q.x.abs() > half {
                    return 0.0;
                }
                let round = |v: DVec3| DVec3::new(0.0, v.y, v.z) / radius_m;
                let end = if inwards.x == 0.0 { f64::INFINITY } else { (half.copysign(inwards.x) - q.x) / inwards.x };
                leaves(round(q), round(inwards)).min(end)
            }
            Shape::Strap { .. } => depth_m * bulge,
        }
    }

    /// Of a strap: the distance along the surface from its middle line, if a part of that faces as `normal` does.
    fn nearest_of_line(&self, p: DVec3, normal: DVec3, width_m: f64) -> Option<f64> {
        let within = width_m / 2.0 + STEP_M;
        let near = self.line.iter().enumerate().filter(|(_, (spot, _))| {
            spot.position.distance_squared(p) <= within * within && faces(normal, spot.normal)
        });
        let last = self.line.len() - 1;
        let away = near.map(|(index, (spot, along))| {
            let place = unrolled(p - spot.position, spot.normal, normal);
            // Its ends are round.
            let ahead = place.dot(*along);
            let (back, front) = (if index == 0 { 0.0 } else { -STEP_M }, if index == last { 0.0 } else { STEP_M });
            (place - *along * ahead.clamp(back, front)).length()
        });
        away.reduce(f64::min)
    }
}

/// The points and directions, a millimetre apart, of a line of `length_m` along the surface through the place of `pose`; shorter where
/// the surface ends.
pub(super) fn middle_line(surface: &WholeSurface, pose: &Pose, length_m: f64) -> Vec<(Spot, DVec3)> {
    let half = length_m / 2.0;
    let mut line = walk(surface, &pose.spot, -pose.along, half).0;
    line.iter_mut().for_each(|(_, along)| *along = -*along);
    line.reverse();
    line.push((pose.spot, pose.along));
    line.extend(walk(surface, &pose.spot, pose.along, half).0);
    line
}

/// The points and directions at steps of a millimetre on the way from `from` in direction `along`, for `length_m` or as far
/// as the surface goes, without `from` itself; and how much of the length is left, m.
pub(super) fn walk(surface: &WholeSurface, from: &Spot, along: DVec3, length_m: f64) -> (Vec<(Spot, DVec3)>, f64) {
    let (mut here, mut along, mut left_m) = (*from, along, length_m);
    let mut way = Vec::new();
    while left_m > END_M {
        let step_m = left_m.min(STEP_M);
        let Some(next) = surface.nearest(here.position + along * step_m, here.normal) else { break };
        if (next.position - here.position).dot(along) < LEAST_ADVANCE * step_m {
            break;
        }
        along = carried(along, here.normal, next.normal);
        along = (along - next.normal * along.dot(next.normal)).normalize_or(along);
        (here, left_m) = (next, left_m - step_m);
        way.push((here, along));
    }
    (way, left_m)
}
