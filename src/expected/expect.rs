//! The errors to expect on one layout.

use super::hexagons;
use super::layout_errors::{LayoutErrors, TestTouches};
use super::trial::Trial;
use crate::body::Body;
use crate::error::Result;

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
