//! Distance sensors: what they see of an indenter before it touches.
//!
//! A taxel sees what lies within 30° of its normal, and reads the least distance to it. Indenters are balls about a core: a point
//! for `ball` and `fingertip`, a line for `rod` and `edge` (of radius 0), a disc for `flat` (the same). With q the core's point
//! nearest to the taxel and R the radius, a taxel sees the ball about q: ‖q − x‖ − R if q is within 30°, else the way along the
//! edge of its sight that comes nearest to q, if that meets the ball. The body itself hides nothing.

use glam::DVec3;

use super::contact::Indenter;

/// The cosine and the sine of 30°.
const SIGHT: [f64; 2] = [0.866_025_403_784_438_6, 0.5];

/// An indenter over the skin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solid {
    core: Core,
    radius_m: f64,
}

#[derive(Clone, Copy, Debug)]
enum Core {
    Point(DVec3),
    Line([DVec3; 2]),
    Disc { middle: DVec3, normal: DVec3, radius_m: f64 },
}

impl Core {
    fn nearest(&self, x: DVec3) -> DVec3 {
        match *self {
            Self::Point(point) => point,
            Self::Line([from, to]) => {
                let way = to - from;
                from + way * ((x - from).dot(way) / way.length_squared()).clamp(0.0, 1.0)
            }
            Self::Disc { middle, normal, radius_m } => {
                let offset = x - middle;
                middle + (offset - normal * offset.dot(normal)).clamp_length_max(radius_m)
            }
        }
    }
}

impl Solid {
    /// `indenter`, whose lowest point is `gap_m` above `place` along `normal`, and which lies along `along`.
    pub(super) fn new(indenter: &Indenter, place: DVec3, normal: DVec3, along: DVec3, gap_m: f64) -> Self {
        let above = |radius_m: f64| place + normal * (gap_m + radius_m);
        let line = |middle: DVec3, length_m: f64| [-0.5, 0.5].map(|end| middle + along * (end * length_m));
        match *indenter {
            Indenter::Ball { radius_m } | Indenter::Fingertip { radius_m, .. } => {
                Self { core: Core::Point(above(radius_m)), radius_m }
            }
            Indenter::Rod { radius_m, length_m } => {
                Self { core: Core::Line(line(above(radius_m), length_m)), radius_m }
            }
            Indenter::Edge { length_m } => Self { core: Core::Line(line(above(0.0), length_m)), radius_m: 0.0 },
            Indenter::Flat { radius_m } => {
                Self { core: Core::Disc { middle: above(0.0), normal, radius_m }, radius_m: 0.0 }
            }
        }
    }

    /// What a taxel at `x` with this normal reads of it, m; `None` where it sees nothing.
    pub(super) fn seen_from(&self, x: DVec3, normal: DVec3) -> Option<f64> {
        let away = self.core.nearest(x) - x;
        let (distance, radius) = (away.length(), self.radius_m);
        if distance <= radius {
            return Some(0.0);
        }
        let up = away.dot(normal);
        if up >= SIGHT[0] * distance {
            return Some(distance - radius);
        }
        let aside = (away - normal * up).normalize_or_zero();
        let along = away.dot(normal * SIGHT[0] + aside * SIGHT[1]);
        let under_root = radius * radius - (distance * distance - along * along);
        (along > 0.0 && under_root >= 0.0 && radius > 0.0).then(|| (along - under_root.sqrt()).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(indenter: Indenter, gap_m: f64, x: [f64; 2]) -> Option<f64> {
        let solid = Solid::new(&indenter, DVec3::ZERO, DVec3::Z, DVec3::X, gap_m);
        solid.seen_from(DVec3::new(x[0], x[1], 0.0), DVec3::Z)
    }

    #[test]
    fn a_ball_is_as_far_as_its_nearest_point_in_sight() {
        let ball = Indenter::Ball { radius_m: 0.01 };
        let near = |a: Option<f64>, b: f64| assert!((a.unwrap() - b).abs() < 1e-12, "{a:?} {b}");
        near(seen(ball, 0.03, [0.0, 0.0]), 0.03);
        near(seen(ball, 0.03, [0.012, 0.016]), 0.02_f64.hypot(0.04) - 0.01);
        // The middle is 45° aside: the nearest of the points within 30°, against points all over the ball.
        let x = DVec3::new(0.04, 0.0, 0.0);
        let mut least = f64::INFINITY;
        for i in 0..2000 {
            for j in 0..200 {
                let (polar, turn) = (std::f64::consts::PI * f64::from(i) / 2000.0, f64::from(j) / 199.0 - 0.5);
                let (sin, cos) = polar.sin_cos();
                let point = DVec3::new(0.01 * sin * turn.cos(), 0.01 * sin * turn.sin(), 0.04 + 0.01 * cos) - x;
                let point_left = DVec3::new(-0.01 * sin, 0.0, 0.04 + 0.01 * cos) - x;
                for point in [point, point_left] {
                    if point.z >= SIGHT[0] * point.length() {
                        least = least.min(point.length());
                    }
                }
            }
        }
        assert_eq!(seen(ball, 0.03, [0.04, 0.0]).is_some(), least.is_finite());
        let aside = [0.028, 0.0];
        let mut least = f64::INFINITY;
        for i in 0..=200_000 {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / 200_000.0).sin_cos();
            let point = DVec3::new(0.01 * sin, 0.0, 0.04 + 0.01 * cos) - DVec3::new(aside[0], 0.0, 0.0);
            if point.z >= SIGHT[0] * point.length() {
                least = least.min(point.length());
            }
        }
        assert!((seen(ball, 0.03, aside).unwrap() - least).abs() < 1e-6, "{least}");
        // Far aside, and from behind.
        assert_eq!(seen(ball, 0.01, [0.06, 0.0]), None);
        let solid = Solid::new(&ball, DVec3::ZERO, DVec3::Z, DVec3::X, 0.03);
        assert_eq!(solid.seen_from(DVec3::ZERO, DVec3::NEG_Z), None);
    }

    #[test]
    fn long_and_flat_ones_are_seen_along_all_they_are() {
        let rod = Indenter::Rod { radius_m: 0.01, length_m: 0.1 };
        assert!((seen(rod, 0.02, [0.045, 0.0]).unwrap() - 0.02).abs() < 1e-12);
        assert!((seen(rod, 0.02, [0.0, 0.01]).unwrap() - (0.01_f64.hypot(0.03) - 0.01)).abs() < 1e-12);
        let edge = Indenter::Edge { length_m: 0.1 };
        assert!((seen(edge, 0.02, [0.03, 0.01]).unwrap() - 0.02_f64.hypot(0.01)).abs() < 1e-12);
        assert_eq!(seen(edge, 0.02, [0.03, 0.012]), None);
        let flat = Indenter::Flat { radius_m: 0.02 };
        assert!((seen(flat, 0.05, [0.01, 0.01]).unwrap() - 0.05).abs() < 1e-12);
        assert!((seen(flat, 0.05, [0.03, 0.0]).unwrap() - 0.05_f64.hypot(0.01)).abs() < 1e-12);
        // What touches is at no distance.
        assert_eq!(seen(flat, 0.0, [0.0, 0.0]), Some(0.0));
        assert_eq!(seen(rod, 0.0, [0.0, 0.0]), Some(0.0));
    }
}
