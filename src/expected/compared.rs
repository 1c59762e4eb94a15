//! Two layouts under the same touches.

use std::time::Instant;

use super::hexagons;
use super::layout_errors::{LayoutErrors, TestTouches};
use super::presses::presses;
use super::trial::{FRAME_S, Trial};
use crate::backend::BackendKind;
use crate::body::Body;
use crate::engine::{Engine, Options};
use crate::error::Result;
use crate::scene::Scene;
use crate::signal::Frame;
use crate::source::GivenPress;
use crate::touch;

/// Passes over the touches by which the time of a frame is measured.
const PASSES: usize = 5;
/// Touches of a pass, at most.
const TIMED: usize = 100;

/// Two layouts under touches of one size, at the same places where their surfaces are the same.
#[derive(Clone, Debug, PartialEq)]
pub struct ComparedLayouts {
    /// The errors of each.
    pub layouts: [LayoutErrors; 2],
    /// The errors of ideal skins with as many taxels on a square metre.
    pub ideal: [LayoutErrors; 2],
    /// Whether both have one surface, and so are touched at the same places.
    pub same_places: bool,
    /// Median time of a live frame with a touch, on the CPU, of all that a run computes by default, s. It is measured, so
    /// it differs each time.
    pub frame_s: [f64; 2],
}

impl ComparedLayouts {
    /// Of the touches that count on both, at the same places, the share whose place is nearer to the truth on the second one; `None`
    /// where there are none.
    #[must_use]
    pub fn second_is_nearer(&self) -> Option<f64> {
        let [first, second] = &self.layouts;
        let both = first.touches.iter().zip(&second.touches).filter_map(|(a, b)| a.as_ref().zip(b.as_ref()));
        let nearer: Vec<bool> = both.filter(|_| self.same_places).map(|(a, b)| b.place_m < a.place_m).collect();
        let count = nearer.iter().filter(|nearer| **nearer).count();
        (!nearer.is_empty()).then(|| count as f64 / nearer.len() as f64)
    }
}

/// Compares the layouts of two bodies by `touches`, which are of the size of the coarser one's spacing unless they have a size.
///
/// # Errors
/// As [`super::expected_errors`], of either.
pub fn compare_layouts(bodies: [&Body; 2], touches: &TestTouches) -> Result<ComparedLayouts> {
    let [mut first, mut second] = [Trial::new(bodies[0])?, Trial::new(bodies[1])?];
    let spacing_m = touches.spacing_m.unwrap_or(first.spacing_m.max(second.spacing_m));
    let touches = touches.spacing_m(spacing_m);
    let same_places = bodies[0].triangles_at_rest() == bodies[1].triangles_at_rest();
    let skins = [first.skin(spacing_m), second.skin(spacing_m)];
    let presses_on = |taken: [bool; 2]| {
        presses(touches.count, spacing_m, |press| {
            skins.iter().zip(taken).all(|(skin, taken)| !taken || skin.skin_at(press).is_some())
        })
    };
    let [of_first, of_second] = match same_places {
        true => [presses_on([true; 2]), presses_on([true; 2])],
        false => [presses_on([true, false]), presses_on([false, true])],
    };
    let layouts = [first.errors(&skins[0], &of_first, spacing_m)?, second.errors(&skins[1], &of_second, spacing_m)?];
    let ideal = [hexagons::errors(first.spacing_m, &touches)?, hexagons::errors(second.spacing_m, &touches)?];
    let timed = |presses: &[GivenPress]| presses.len().min(TIMED);
    let frames = [
        first.frames_of(&skins[0], &of_first[..timed(&of_first)]),
        second.frames_of(&skins[1], &of_second[..timed(&of_second)]),
    ];
    let frame_s = [time_of_frame(bodies[0], &first, &frames[0])?, time_of_frame(bodies[1], &second, &frames[1])?];
    Ok(ComparedLayouts { layouts, ideal, same_places, frame_s })
}

/// Median time of one of `frames`, one after the other, s.
fn time_of_frame(body: &Body, trial: &Trial<'_>, frames: &[Frame]) -> Result<f64> {
    let scene = Scene::default().touches(touch::Options::default());
    let options = Options::default().scene(scene).calibration(trial.calibration()?).backend(BackendKind::Cpu);
    let mut engine = Engine::new(body, options)?;
    engine.set_channels(&trial.ids())?;
    let mut times_s = Vec::with_capacity(PASSES * frames.len());
    let mut t_s = 0.0;
    for frame in (0..PASSES).flat_map(|_| frames) {
        let frame = Frame { t_s, ..frame.clone() };
        let began = Instant::now();
        engine.process_one(&frame)?;
        times_s.push(began.elapsed().as_secs_f64());
        t_s += FRAME_S;
    }
    times_s.sort_by(f64::total_cmp);
    Ok(times_s.get(times_s.len() / 2).copied().unwrap_or(0.0))
}
