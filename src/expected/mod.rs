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
//! use somatic::internal::expected::{TestTouches, expected_errors, ideal_errors};
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
mod expect;
mod hexagons;
mod json;
mod layout_errors;
mod presses;
mod trial;

pub use compared::{ComparedLayouts, compare_layouts};
pub use expect::{expected_and_ideal_errors, expected_errors, ideal_errors};
pub use layout_errors::{LayoutErrors, Percentiles, TestTouches, TouchError};
