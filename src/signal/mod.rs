//! Signals: what arrives from the sensors, and what a robot's calibration makes of it.

mod frame;

pub use frame::{Frame, Pose, RawValue};
