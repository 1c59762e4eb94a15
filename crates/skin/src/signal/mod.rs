//! Signals: the sensors' raw values, and their calibration.

mod block;
mod board_health;
mod calibration;
mod channel;
mod curve;
mod drift;
mod frame;
mod frame_time;
mod fsr;
mod intake;
mod leak;
mod letter;
mod response;
mod sense;
mod unit;
mod wiring;

pub use block::FrameBlock;
pub use board_health::BoardHealth;
pub use calibration::{
    Calibration, ChangeCalibration, Checks, ContactThresholds, LaidOver, LayerResponse, Onset, Sensors,
    TaxelCalibration,
};
pub use channel::{Axis, Channel};
pub use curve::Curve;
pub use curve::slope;
pub use drift::{DriftCompensation, Kept, MIN_UNTOUCHED};
pub use drift::{DriftKeys, Unfit};
pub use frame::{FARTHEST_POSE_M, Frame, Pose, RawValue};
pub use frame_time::FrameTime;
pub use fsr::FsrCircuit;
pub use intake::{Intake, IntakeState};
pub use letter::{Letter, Mark, Receptor};
pub use response::{FsrResponse, FsrSignal, Response};
#[doc(hidden)]
pub use sense::HUGE;
pub use sense::{Reading, Sense, SenseCalibration, SenseResponse, ShearCalibration};
pub use unit::{Quantity, UnitOfP};
pub use wiring::{WiredBoard, Wiring};
