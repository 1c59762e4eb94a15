//! Signals: the sensors' raw values, and their calibration.

mod block;
mod board_health;
mod calibration;
mod curve;
mod frame;
mod frame_time;
mod fsr;
mod intake;
mod letter;
mod response;
mod unit;
mod upkeep;
mod wiring;

pub use block::FrameBlock;
pub use board_health::BoardHealth;
pub use calibration::{
    Calibration, ChangeCalibration, Checks, ContactThresholds, LaidOver, Onset, SkinResponse, TaxelCalibration,
};
pub use curve::Curve;
pub(crate) use curve::slope;
pub use frame::{FARTHEST_POSE_M, Frame, Pose, RawValue};
pub use frame_time::FrameTime;
pub use fsr::FsrCircuit;
pub(crate) use intake::{Intake, IntakeState};
pub use letter::{Letter, Mark, Receptor};
pub use response::{FsrResponse, FsrSignal, Response};
pub use unit::{Quantity, UnitOfP};
pub(crate) use upkeep::{Kept, MIN_UNTOUCHED, Upkeep};
pub use upkeep::{Unfit, UpkeepKeys};
pub use wiring::{WiredBoard, Wiring};
