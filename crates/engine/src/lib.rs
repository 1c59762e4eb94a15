//! Frames of touch in, percepts out: the stages of a skin's percepts, three backends that compute them, and the touches of a whole body.
//!
//! It is the middle floor of `somatic`, which has all of it under its own name; a program uses that.
//!
//! * [`scene`]: what is asked for, and the plan that the engine makes of it.
//! * [`Engine`]: a plan, a backend and what lies between two frames.
//! * [`backend`]: `reference` in f64, `cpu` in lanes, `gpu` in WGSL, and the bounds that hold the two to the first.
//! * [`touch`]: touches of the whole body, found on its skin.
//! * [`percept`]: what comes out.
//! * [`gains`]: how much each sensor says of what it feels, from recorded touches.

#![deny(missing_docs)]
#![warn(unreachable_pub)]

#[cfg(test)]
extern crate self as somatic;
// Its macros `setters!` and `words!`.
#[macro_use]
extern crate somatic_skin;

pub mod backend;
#[doc(hidden)]
pub mod engine;
pub mod gains;
pub mod percept;
pub mod scene;
#[doc(hidden)]
pub mod shape;
#[doc(hidden)]
pub mod stage;
pub mod touch;

pub use backend::BackendKind;
pub use backend::agreement::{Agreement, ComparedColumn, Comparison, Verdict};
pub use engine::{ChosenBackend, Engine, EngineState, Options};
#[cfg(test)]
use somatic_bodies as bundled;
#[allow(unused_imports, reason = "which of them are used depends on features")]
use somatic_skin::{body, error, field, length, limits, parallel, random, signal};
