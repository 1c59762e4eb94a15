//! How far the quantities of a touch may be off where each pull wP may be off by a share r of itself, and where its choices are in
//! doubt for that.
//!
//! With S = Σ wP and ρ = r/(1 − r): every pull changes by at most r wP, and S by r S.
//!
//! * A sum of pulls is off by r of itself, a torque by r Σ|x × F|.
//! * A weighted mean c is off by δc = ρ Σ wP‖x − c‖ / S, as Σ wP (x − c) = 0.
//! * The position is the nearest point of the surface to c. The nearest point of each triangle moves by at most δc. Another
//!   triangle may be nearest only if it is at most 2 δc farther: to δc comes the distance to the farthest of their nearest points.
//! * The moments M = Σ wP (x − c)(x − c)ᵀ / S are off by at most E = 2ρ T + δc² in any direction, with T their trace: eigenvalues by E,
//!   √λ by min(√E, E/√λ), the difference h of two by 2E, and the axis turns by ½ asin(2E/h).
//! * A point (wP/S)(x − c) is off by (wP/S)(2ρ‖x − c‖ + δc), and the line between two by the asin of both over its length.
//!
//! In doubt are: the base, if another taxel is at most 2 δc farther from c; the farthest points, if others may be as far; the link,
//! if another's total is as near as both are off; `isotropic` and `coincident` within their bounds. Rounding in double precision counts as
//! a share [`ROUNDING`] more.

use glam::DVec3;

use super::moments::{ISOTROPIC, NEAR};

/// What rounding in double precision makes of sums over a touch: up to 10⁵ taxels, and lengths that are 10⁵ times a touch's size.
pub(super) const ROUNDING: f64 = 1e-10;

/// How far a touch's quantities may be off; `None` where that is not known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bound {
    /// Of total, force, and by taxel the force of a wrench, as a share.
    pub(crate) share: f64,
    /// Of the weighted mean in space, m.
    pub(crate) mean_m: f64,
    /// Of the position, m.
    pub(crate) position_m: f64,
    /// Along and across, m.
    pub(crate) spread_m: [f64; 2],
    pub(crate) anisotropy: f64,
    /// Of the principal axis, rad.
    pub(crate) axis_rad: Option<f64>,
    /// Of the line through the two farthest points, rad.
    pub(crate) orientation_rad: Option<f64>,
    /// Whether the anisotropy may be on the other side of the limit.
    pub(crate) isotropic_in_doubt: bool,
    /// Whether the second and third farthest points may be a tie or not.
    pub(crate) tie_in_doubt: bool,
}

/// ρ = r/(1 − r) for the share r.
fn ratio(share: f64) -> f64 {
    if share < 0.5 { share / (1.0 - share) } else { f64::INFINITY }
}

/// How far the weighted mean of `places` is off, each with its pull, m.
pub(super) fn of_mean(places: &[(DVec3, f64)], mean: DVec3, share: f64) -> f64 {
    let total: f64 = places.iter().map(|(_, pull)| pull).sum();
    let arm: f64 = places.iter().map(|(place, pull)| pull * place.distance(mean)).sum();
    ratio(share + ROUNDING) * arm / total + share_of_size(places, mean)
}

/// The rounding of lengths.
fn share_of_size(places: &[(DVec3, f64)], mean: DVec3) -> f64 {
    ROUNDING * places.iter().map(|(place, _)| place.distance(mean)).fold(0.0, f64::max)
}

/// The error bound of the nearest point of a surface. `nearest` are the points of its triangles nearest to the mean, each with its
/// distance; `position` is the nearest of them.
pub(super) fn of_position(
    nearest: impl Iterator<Item = (DVec3, f64)>,
    position: DVec3,
    least_m: f64,
    mean_m: f64,
) -> f64 {
    // Corners are in single precision about their taxels: within some nanometres.
    let rounding_m = 1e-8;
    let may_be = nearest.filter(|(_, distance_m)| *distance_m <= least_m + 2.0 * mean_m + rounding_m);
    mean_m + rounding_m + may_be.map(|(point, _)| point.distance(position)).fold(0.0, f64::max)
}

/// The bound of the form of a touch at `places` in its chart, each with its pull, whose mean is `mean`, with the two larger
/// eigenvalues `moments`.
pub(super) fn of_form(places: &[(DVec3, f64)], mean: DVec3, moments: [f64; 2], share: f64) -> Bound {
    let (total, rho) = (places.iter().map(|(_, pull)| pull).sum::<f64>(), ratio(share + ROUNDING));
    let off_m = of_mean(places, mean, share);
    let trace = moments[0] + moments[1];
    let whole: f64 = places.iter().map(|(place, pull)| pull / total * place.distance_squared(mean)).sum();
    let entry = 2.0 * rho * whole + off_m * off_m + ROUNDING * whole;
    let h = moments[0] - moments[1];
    let spread = |moment: f64| if moment > 0.0 { (entry / moment.sqrt()).min(entry.sqrt()) } else { entry.sqrt() };
    let anisotropy =
        if 2.0 * entry < trace { (2.0 * entry + 2.0 * entry * h / trace) / (trace - 2.0 * entry) } else { 1.0 };
    let point = |&(place, pull): &(DVec3, f64)| {
        let (arm, pull) = ((place - mean) * (pull / total), pull / total);
        (arm, pull * (2.0 * rho * place.distance(mean) + off_m))
    };
    let mut points: Vec<(DVec3, f64)> = places.iter().map(point).collect();
    points.sort_by(|a, b| b.0.length().total_cmp(&a.0.length()));
    let (mut orientation_rad, mut tie_in_doubt) = (None, false);
    if let [(first, off_1), (second, off_2), rest @ ..] = &points[..] {
        let reach = |(point, off): &(DVec3, f64)| point.length() + off;
        let farthest_else = rest.iter().map(reach).fold(0.0, f64::max);
        let length = first.distance(*second);
        let off = off_1 + off_2;
        let is_certain =
            second.length() - off_2 > farthest_else && length - NEAR * first.length() > off && 2.0 * off < length;
        orientation_rad = is_certain.then(|| libm::asin(off / length) + ROUNDING);
        let third = rest.first().map_or(f64::NEG_INFINITY, |(point, _)| point.length());
        let worst = points.iter().map(|(_, off)| *off).fold(0.0, f64::max);
        tie_in_doubt = !is_certain || (second.length() - third - NEAR * first.length()).abs() <= 3.0 * worst;
    }
    Bound {
        share: share + ROUNDING,
        mean_m: off_m,
        position_m: f64::INFINITY,
        spread_m: moments.map(spread),
        anisotropy,
        axis_rad: (2.0 * entry < h).then(|| libm::asin(2.0 * entry / h) / 2.0 + ROUNDING),
        orientation_rad,
        isotropic_in_doubt: trace > 0.0 && (h / trace - ISOTROPIC).abs() <= anisotropy,
        tie_in_doubt,
    }
}
