//! Everything that is tested from outside, in one binary, so that all tests share one device.

mod batches;
mod bodies;
mod change;
mod common;
mod draft;
mod extremes;
mod filter;
mod geodesic;
mod grouping;
mod house;
mod icub;
mod legal;
mod letters;
mod meshes;
mod motion;
mod properties;
mod real;
mod recordings;
mod simulated;
mod touch;
mod upkeep;
