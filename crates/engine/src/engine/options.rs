//! What is asked of an engine, and what it runs on.

use crate::backend::BackendKind;
use crate::scene::Scene;
use crate::signal::Calibration;

/// What an engine is to do; the default is everything, uncalibrated, one frame a call, on whatever is fastest.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Options {
    /// What is asked for.
    pub scene: Scene,
    /// The robot's calibration; without one P is the raw value.
    pub calibration: Option<Calibration>,
    /// What it runs on.
    pub backend: BackendKind,
    /// Take the first frame's values as the baselines: only for a robot that nothing touches when it starts.
    pub tare: bool,
    /// Frames a call, about: 1 for a live robot, some hundred for recordings. More are taken in turns.
    pub batch: usize,
}

setters!(Options {
    scene: Scene,
    calibration: impl Into<Option<Calibration>>,
    backend: BackendKind,
    tare: bool,
    batch: usize,
});

impl Default for Options {
    fn default() -> Self {
        Self { scene: Scene::default(), calibration: None, backend: BackendKind::Auto, tare: false, batch: 1 }
    }
}

/// The backend of an engine.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct ChosenBackend<'a> {
    /// Its name: `reference`, `cpu` or `gpu`.
    pub name: &'static str,
    /// What it runs on, in words.
    pub device: String,
    /// Why it was chosen, in words.
    pub reason: &'a str,
}

#[cfg(test)]
mod tests {
    use crate::Engine;
    use crate::body::Body;
    use crate::signal::{Frame, RawValue};

    use super::*;

    #[test]
    fn a_value_is_set_by_its_taxels_id_and_taxels_that_are_not_there_are_refused() {
        let body = Body::from_bytes("hand", crate::bundled::HAND).unwrap();
        let engine = Engine::new(&body, Options::default().backend(BackendKind::Reference)).unwrap();
        let mut frame = engine.frame(0.0);
        engine.set_value(&mut frame, body.taxels[2].id, 7.0_f32).unwrap();
        assert_eq!(frame.values[2], RawValue::new(7.0));
        let why = engine.set_value(&mut frame, 4_000_000, RawValue::FAULTY).unwrap_err().to_string();
        assert!(why.contains("no taxel 4000000"), "{why}");
        let why = engine.set_value(&mut Frame::missing(0.0, 2), body.taxels[0].id, 7.0_f32).unwrap_err().to_string();
        assert!(why.contains("has 2 values"), "{why}");
    }

    #[test]
    fn an_engine_says_what_it_runs_on() {
        let body = Body::from_bytes("hand", crate::bundled::HAND).unwrap();
        let engine = Engine::new(&body, Options::default().backend(BackendKind::Reference)).unwrap();
        let ChosenBackend { name, device, reason } = engine.backend();
        assert!(name == "reference" && !device.is_empty() && !reason.is_empty(), "{engine:?}");
    }
}
