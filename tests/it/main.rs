//! Everything that is tested from outside, in one binary, so that all tests share one device.

mod areas;
mod author;
mod batches;
mod blender;
mod blocks;
mod bodies;
mod body_touches;
mod change;
mod common;
mod controller;
mod draft;
mod edited;
mod endurance;
mod even;
mod expected;
mod extremes;
mod filter;
mod firmware;
mod fit;
mod fit_cells;
mod fits_of_touches;
mod gains;
mod gate;
mod geodesic;
mod grouping;
mod hidden;
mod house;
mod icub;
mod imported;
mod knobs;
mod legal;
mod letters;
mod lint;
mod meshes;
mod mirrored;
mod motion;
mod on_skin;
mod paths;
mod properties;
mod real;
mod recordings;
// The skins of `somatic bench`.
mod drift;
#[allow(dead_code, unused_imports, reason = "not every test and bench needs all of it")]
#[path = "../../src/experiments/shape.rs"]
mod shape;
mod simulated;
mod skipped;
#[path = "../skips/mod.rs"]
mod skips;
mod state;
mod sure;
mod sure_on_skin;
mod touch;
mod validator;
mod verify;
mod wire;
mod world;
mod worst;

// The library's own numbers that look like chance.
use somatic_skin::random;
