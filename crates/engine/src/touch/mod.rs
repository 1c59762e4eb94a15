//! Touches of the whole body.
//!
//! A touch is found on the skin itself, wherever it is: over the borders of fields, around limbs, and over joints where one surface
//! goes on. It has its own chart where it is.
//!
//! 1. **Regions** (`regions.rs`, `profile.rs`): pressed taxels that are connected in the graph of neighbours
//!    ([`crate::field::TaxelGraph`]), divided at saddles where the mean pressure between two peaks dips. Taxels without a value are
//!    bridges (`bridges.rs`).
//! 2. **Identity** (`identity.rs`): most shared pressure, from onset to release, with hysteresis on a touch's total.
//! 3. **Quantities** (`measure.rs`, `moments.rs`, `chart.rs`, `cell_tree.rs`, `trail.rs`): sums; the point of the skin nearest to
//!    the weighted mean in space; axis, spread and orientation in the chart of the touch; velocity on the skin; force and torque by
//!    link. Fits and standard deviations are made by the engine, which has the raw values.
//!
//! All is in double precision, on the body at rest; quantities come out in the frame of the touch's link. `reference.rs` is the
//! same as a definition, written plainly and slowly, with the margins of its choices: what a comparison holds touches to.
//!
//! **Cost.** A frame costs a look at every pressure, and the rest by pressed taxel. After the first frames nothing is allocated.

mod bound;
mod bridges;
mod cell_tree;
mod chart;
mod identity;
#[cfg(test)]
mod layouts;
mod load;
mod measure;
mod moments;
mod options;
mod profile;
pub mod reference;
mod regions;
mod skin;
#[cfg(test)]
mod tests;
mod touches;
mod trail;
mod unrolled;

pub use options::{Options, Splits};
pub use skin::{Reading, Skin, SkinParts, SkinTaxel};
pub use touches::{Input, TouchState, Touches};
pub(crate) use trail::Trail;
pub use unrolled::Unrolled;
