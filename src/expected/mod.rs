//! How true touches will be on a layout: touches of known place, axis and force are simulated at random places of its skin, and what
//! the engine finds is held against the truth.
//!
//! A **point** is pressure that falls off from a place of the skin, along the surface, as a Gaussian with a standard deviation of half
//! a spacing: what a finger's breadth presses through a layer. A **line** is the same around a line of four spacings along the surface,
//! in any direction. Half of the touches are points, half are lines. A *spacing* is the root of the mean cell. Sensors feel the
//! force on their cells; they have 10 bits and noise of 1.5 % of a touch's largest value, and are 0 below six standard
//! deviations of it. Places are spread evenly over the surface near taxels. Touches that three taxels or more feel are counted.
//!
//! ```
//! use somatic::expected::{TestTouches, expected_errors, ideal_errors};
//! use somatic::{Body, bundled};
//!
//! # fn main() -> somatic::Result<()> {
//! let hand = Body::from_bytes("hand", bundled::HAND)?;
//! let touches = TestTouches::default().count(40);
//! let (hand, ideal) = (expected_errors(&hand, &touches)?, ideal_errors(&hand, &touches)?);
//! let (place, ideal) = (hand.place_m().unwrap(), ideal.place_m().unwrap());
//! println!("{} mm off, beside {} mm on a flat hexagonal skin", 1e3 * place.median, 1e3 * ideal.median);
//! # Ok(())
//! # }
//! ```

mod compared;
mod hexagons;
mod trial;

pub use compared::{ComparedLayouts, compare_layouts};

use glam::DVec3;

use self::trial::Trial;
use crate::author::random::Random;
use crate::body::Body;
use crate::error::{Error, Result};
use crate::source::GivenPress;

/// Standard deviation of the pressure, and length of a line, in spacings.
const SIGMA_SPACINGS: f64 = 0.5;
const LINE_SPACINGS: f64 = 4.0;
/// Places that are tried for each touch at most: the others are on surface without taxels.
const MAX_TRIES: usize = 200;
const SEED: u64 = 46;

/// What is simulated.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct TestTouches {
    /// Number of touches.
    pub count: usize,
    /// The spacing by which the touches are sized, m; `None` is the layout's own.
    pub spacing_m: Option<f64>,
}

setters!(TestTouches { count: usize, spacing_m: impl Into<Option<f64>> });

impl Default for TestTouches {
    fn default() -> Self {
        Self { count: 400, spacing_m: None }
    }
}

/// What is found of a touch, against the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchError {
    /// Distance of its position from that of the truth, m.
    pub place_m: f64,
    /// Of a line: the angle between the principal axes, rad. Absent of one that is wrapped around a limb, or has an anisotropy under 0.4.
    pub axis_rad: Option<f64>,
    /// Its force over the true one, less 1.
    pub force: f64,
}

/// Two percentiles of errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Percentiles {
    /// Number of errors.
    pub count: usize,
    /// The middle one.
    pub median: f64,
    /// The 95th percentile.
    pub p95: f64,
}

/// The errors to expect on a layout.
#[derive(Clone, Debug, PartialEq)]
pub struct LayoutErrors {
    /// Number of pressure taxels.
    pub taxels: usize,
    /// The root of the mean cell, m.
    pub spacing_m: f64,
    /// The spacing by which the touches were sized, m.
    pub touch_spacing_m: f64,
    /// What was found of each touch; `None` of those that fewer than three taxels feel.
    pub touches: Vec<Option<TouchError>>,
}

impl Percentiles {
    /// Those of `errors`, if there are any.
    fn of(errors: impl Iterator<Item = f64>) -> Option<Self> {
        let mut errors: Vec<f64> = errors.collect();
        errors.sort_by(f64::total_cmp);
        let rank = |share: f64| {
            let rank = (share * errors.len() as f64).ceil() as usize;
            errors.get(rank.max(1) - 1).copied()
        };
        Some(Self { count: errors.len(), median: rank(0.5)?, p95: rank(0.95)? })
    }
}

impl LayoutErrors {
    /// The touches that count.
    pub fn counted(&self) -> impl Iterator<Item = &TouchError> {
        self.touches.iter().flatten()
    }

    /// Errors of the position, m; `None` if no touch counts.
    #[must_use]
    pub fn place_m(&self) -> Option<Percentiles> {
        Percentiles::of(self.counted().map(|touch| touch.place_m))
    }

    /// Errors of the principal axes of lines, rad; `None` if none has one.
    #[must_use]
    pub fn axis_rad(&self) -> Option<Percentiles> {
        Percentiles::of(self.counted().filter_map(|touch| touch.axis_rad))
    }

    /// Errors of the force, whatever their sign, as shares of it; `None` if no touch counts.
    #[must_use]
    pub fn force(&self) -> Option<Percentiles> {
        Percentiles::of(self.counted().map(|touch| touch.force.abs()))
    }
}

/// The errors to expect on `body`, by `touches`.
///
/// # Errors
/// The body has no surface, no pressure taxels, or none of these near its surface.
pub fn expected_errors(body: &Body, touches: &TestTouches) -> Result<LayoutErrors> {
    Trial::new(body)?.errors_at_random(touches)
}

/// The same on an ideal skin with as many taxels on a square metre as `body` has: a flat sheet, far from its borders, of cells that
/// are all the same regular hexagon.
///
/// # Errors
/// As [`expected_errors`].
pub fn ideal_errors(body: &Body, touches: &TestTouches) -> Result<LayoutErrors> {
    hexagons::errors(Trial::new(body)?.spacing_m, touches)
}

/// [`expected_errors`] and [`ideal_errors`] of `body`, which cost less together.
///
/// # Errors
/// As [`expected_errors`].
pub fn expected_and_ideal_errors(body: &Body, touches: &TestTouches) -> Result<[LayoutErrors; 2]> {
    let mut trial = Trial::new(body)?;
    Ok([trial.errors_at_random(touches)?, hexagons::errors(trial.spacing_m, touches)?])
}

/// The presses that are tried, in their order, for touches of the size of `spacing_m`: the first ones that `is_at` takes, up to
/// `count`.
fn presses(count: usize, spacing_m: f64, mut is_at: impl FnMut(&GivenPress) -> bool) -> Vec<GivenPress> {
    let mut random = Random::new(SEED);
    let mut next = |number: usize| GivenPress {
        chance: [random.unit(), random.unit(), random.unit()],
        turns: random.unit(),
        length_m: if number % 2 == 0 { 0.0 } else { LINE_SPACINGS * spacing_m },
    };
    let tried = (0..count.saturating_mul(MAX_TRIES)).map(&mut next);
    tried.filter(|press| is_at(press)).take(count).collect()
}

/// The angle between two lines, rad.
fn between(a: DVec3, b: DVec3) -> f64 {
    libm::atan2(a.cross(b).length(), a.dot(b).abs())
}

/// `vector`, turned as the plane across `from` is turned to that across `to`, on the shortest way.
fn turned(vector: DVec3, from: DVec3, to: DVec3) -> DVec3 {
    let (axis, cos) = (from.cross(to), from.dot(to));
    vector * cos + axis.cross(vector) + axis * (axis.dot(vector) / (1.0 + cos))
}

/// That nothing on `body` could be touched.
fn untouchable(body: &Body, why: &str) -> Error {
    Error::failed(format!("errors of touches cannot be simulated: {why}")).at(&body.name)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    #[test]
    fn percentiles_are_of_what_is_there() {
        let of = Percentiles::of((1..=200).rev().map(f64::from)).unwrap();
        assert_eq!(of, Percentiles { count: 200, median: 100.0, p95: 190.0 });
        assert_eq!(Percentiles::of([3.0].into_iter()), Some(Percentiles { count: 1, median: 3.0, p95: 3.0 }));
        assert_eq!(Percentiles::of(std::iter::empty()), None);
    }

    #[test]
    fn a_direction_is_turned_with_its_plane() {
        let tilted = DVec3::new(0.0, 0.6, 0.8);
        assert!(turned(DVec3::X, DVec3::Z, tilted).distance(DVec3::X) < 1e-12);
        assert!(turned(DVec3::Y, DVec3::Z, tilted).distance(DVec3::new(0.0, 0.8, -0.6)) < 1e-12);
        assert!((between(DVec3::X, -DVec3::Y) - FRAC_PI_2).abs() < 1e-12 && between(DVec3::X, -DVec3::X) < 1e-12);
    }

    #[test]
    fn a_press_that_is_left_out_changes_no_other() {
        let all = presses(20, 0.01, |_| true);
        let mut number = 0;
        let odd = presses(10, 0.01, |_| {
            number += 1;
            number % 2 == 0
        });
        assert_eq!(odd, all.into_iter().skip(1).step_by(2).collect::<Vec<_>>());
        assert!(odd.iter().all(|press| press.length_m == 0.04));
        assert!(presses(2, 0.01, |_| false).is_empty());
    }
}
