//! Everything that is tested from outside, in one binary, so that all tests share one device.

mod author;
mod batches;
mod blender;
mod bodies;
mod change;
mod common;
mod draft;
mod edited;
mod extremes;
mod filter;
mod geodesic;
mod grouping;
mod house;
mod icub;
mod legal;
mod letters;
mod lint;
mod meshes;
mod motion;
mod properties;
mod real;
mod recordings;
mod simulated;
mod touch;
mod upkeep;
mod validator;
