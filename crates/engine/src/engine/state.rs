//! The state between frames as one value.

use super::Engine;
use super::cadence::ChangeState;
use super::drift_state::DriftState;
use super::letters::Room;
use super::on_skin::{OnSkin, OnSkinState};
use super::post::PostState;
use crate::backend::BackendState;
use crate::error::{Error, Result};
use crate::signal::{FrameTime, IntakeState, ShearCalibration, TaxelCalibration};
use crate::stage::layout;

/// Everything that the next percepts depend on beside the next frames.
///
/// ```
/// # mod somatic { pub use somatic_bodies as bundled; pub use somatic_engine::{Engine, Options, percept::TouchFrame, scene::Scene, touch}; pub use somatic_skin::{body::Body, error::Result, signal, signal::RawValue}; }
/// # fn main() -> somatic::Result<()> {
/// use somatic::{Body, Engine, Options, RawValue, bundled};
///
/// let body = Body::from_bytes("hand", bundled::HAND)?;
/// let mut engine = Engine::new(&body, Options::default())?;
/// let mut frame = engine.frame(0.0);
/// frame.values.fill(RawValue::new(1.0));
/// engine.process_one(&frame)?;
///
/// let state = engine.state()?;
/// frame.t_s = 0.01;
/// let percepts = engine.process_one(&frame)?.clone();
/// // Later, on this engine or another of the same body and options: the same bits.
/// engine.restore(&state)?;
/// assert_eq!(*engine.process_one(&frame)?, percepts);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct EngineState {
    frames_done: u64,
    last_time: Option<FrameTime>,
    tare: bool,
    /// By channel and by slot, and of tangential values, if the calibration may change.
    calibration: Option<(Vec<TaxelCalibration>, Vec<layout::Taxel>, Option<ShearCalibration>)>,
    intake: IntakeState,
    backend: BackendState,
    post: PostState,
    cadence: Option<ChangeState>,
    drift: Option<DriftState>,
    touches: Option<OnSkinState>,
}

impl EngineState {
    /// Number of frames that were processed before it.
    #[must_use]
    pub fn frames(&self) -> u64 {
        self.frames_done
    }
}

impl Engine {
    /// The state after the frames so far, so that a recording can be entered here again: to scrub, to resume, or to compare
    /// from here on ([`Engine::process_and_compare`]). On a GPU it waits for the device.
    ///
    /// # Errors
    /// The device was lost.
    pub fn state(&mut self) -> Result<EngineState> {
        Ok(EngineState {
            frames_done: self.frames_done,
            last_time: self.last_time,
            tare: self.tare,
            calibration: self
                .recalibrates
                .then(|| (self.plan.calibrations.clone(), self.plan.taxels.clone(), self.plan.senses.shear.clone())),
            intake: self.intake.state().clone(),
            backend: self.backend.state()?,
            post: self.post.clone(),
            cadence: self.cadence.as_ref().map(|cadence| cadence.state.clone()),
            drift: self.drift.clone(),
            touches: self.on_skin.as_ref().map(OnSkin::state),
        })
    }

    /// Goes on from `state`, of an engine with the same body, scene, calibration and options. On the same backend, percepts are
    /// the same bits as those of an uninterrupted run; on another they agree within its bounds.
    ///
    /// # Errors
    /// The state does not fit this engine ([`Error::is_usage`]), or the device was lost.
    pub fn restore(&mut self, state: &EngineState) -> Result<()> {
        let fits = state.backend.fields.len() == self.plan.fields.len()
            && state.backend.raw.len() == self.plan.channels()
            && state.intake.taxels() == self.ids.len()
            && state.calibration.is_some() == self.recalibrates
            && state.cadence.is_some() == self.cadence.is_some()
            && state.drift.is_some() == self.drift.is_some()
            && state.touches.is_some() == self.on_skin.is_some();
        if !fits {
            return Err(Error::usage(
                "the state is of an engine with another body, scene or calibration; restore it where it fits",
            ));
        }
        if let Some((calibrations, taxels, shear)) = &state.calibration {
            self.plan.calibrations.clone_from(calibrations);
            self.plan.taxels.clone_from(taxels);
            self.plan.senses.shear.clone_from(shear);
            self.plan.calibration_changes += 1;
            self.recalibrate(None);
        }
        self.backend.restore(&state.backend)?;
        self.intake.restore(&state.intake);
        self.post.clone_from(&state.post);
        self.post.room = Room::new(&self.plan);
        self.drift.clone_from(&state.drift);
        if let (Some(cadence), Some(state)) = (&mut self.cadence, &state.cadence) {
            cadence.state.clone_from(state);
        }
        if let (Some(on_skin), Some(touches)) = (&mut self.on_skin, &state.touches) {
            on_skin.restore(touches);
        }
        (self.frames_done, self.last_time, self.tare) = (state.frames_done, state.last_time, state.tare);
        self.check = None;
        Ok(())
    }
}
