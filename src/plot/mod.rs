//! Plots of recordings: quantities over time, the highest pressures with the path of the centre of pressure, and the
//! pressure–time integrals, several recordings side by side.
//!
//! A [`Gatherer`] sees what an engine makes of a recording, in memory that does not grow with it; [`svg()`] and [`png()`] draw
//! what was gathered.

mod absences;
mod draw;
mod gather;
mod line;
mod map;
mod page;
mod path;
mod pen;
mod series;
mod ticks;
mod units;

pub use draw::{png, svg};
pub use gather::{Gathered, Gatherer, outputs_for, wanted_of};
