//! Touches of a whole body: an indenter presses its skin, across links and joints; see `docs/reference/simulation.md`.
//!
//! All of it happens on the body at rest, in the body's own frame; truth is in the frames of links.

mod cells;
mod chart;
mod footprint;
mod given;
mod indenter;
mod layer;
mod path;
mod pieces;
mod press;
mod surface;
#[cfg(test)]
mod tests;
mod touch;

pub(super) use self::chart::carried;
pub use self::given::{GivenPress, GivenPresses, GivenTruth, NoisySensors};
pub(super) use self::indenter::Shape;
pub(super) use self::path::{BodyPath, Waypoint};
pub(super) use self::touch::{BodySkin, BodyTouch, Contact, Covers, Tool};
