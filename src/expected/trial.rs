//! A layout that is tried: its skin, and an engine that finds touches on it.

use glam::DVec3;

use super::layout_errors::{LayoutErrors, TestTouches, TouchError};
use super::presses::{SIGMA_SPACINGS, presses};
use crate::backend::BackendKind;
use crate::body::{Body, ChartKind, ChartSpec, FieldSpec};
use crate::engine::{Engine, Options};
use crate::error::{Error, Result};
use crate::parallel;
use crate::percept::{Outputs, Touch, TouchFlags, TouchOutputs};
use crate::scene::Scene;
use crate::signal::{Calibration, Frame, RawValue};
use crate::source::{GivenPress, GivenPresses, GivenTruth, NoisySensors};
use crate::touch;

/// Noise as a share of a touch's largest value, what that value reads, and how many standard deviations of the noise read 0.
const NOISE: f64 = 0.015;
const STEPS: f64 = 800.0;
const DEAD_SIGMAS: f64 = 6.0;
/// Of rounding to whole steps.
const ROUNDING: f64 = 0.29;
/// Taxels of a touch that counts, at least, and the anisotropy of one whose axis counts.
const MIN_TAXELS: u32 = 3;
const MIN_ANISOTROPY: f64 = 0.4;
/// Presses of one call of the engine; after each the skin is at rest for a frame.
const BATCH: usize = 32;
pub(super) const FRAME_S: f64 = 0.04;
const SEED: u64 = 46;

const SENSORS: NoisySensors = NoisySensors { noise: NOISE, steps: STEPS, seed: SEED };

/// A layout that is tried.
pub(super) struct Trial<'a> {
    pub(super) body: &'a Body,
    engine: Engine,
    /// Per pressure taxel its index in the body, and the side of a square of its cell's area, m.
    sides_m: Vec<(usize, f64)>,
    /// The root of the mean cell, m.
    pub(super) spacing_m: f64,
    frames: u32,
}

impl<'a> Trial<'a> {
    /// The layout of `body`.
    pub(super) fn new(body: &'a Body) -> Result<Self> {
        if body.surfaces.iter().all(|surface| surface.triangles.is_empty()) {
            return Err(untouchable(body, "it has no surface; author its taxels on a mesh"));
        }
        let pressure = || body.taxels.iter().filter(|taxel| taxel.modality.is_pressed());
        let ids: Vec<u32> = pressure().map(|taxel| taxel.id).collect();
        if ids.is_empty() {
            return Err(untouchable(body, "it has no pressure taxels; give it some with `somatic author`"));
        }
        // Touches are found on the whole skin; the layout's own fields, and their charts, take time and have no part in it.
        let chart = ChartSpec { kind: ChartKind::None, origin_in_anchor: None, u_in_anchor: None };
        let field = FieldSpec { name: "skin".to_owned(), chart: Some(chart), ..FieldSpec::default() };
        let of_one_field = Body { fields: vec![field.with_members(ids.iter().copied())], ..body.clone() };
        let asked =
            TouchOutputs::TOTAL | TouchOutputs::POSITION | TouchOutputs::PRINCIPAL_AXIS | TouchOutputs::ANISOTROPY;
        let touches = touch::Options { outputs: asked, ..touch::Options::default() };
        let scene = Scene::default().outputs(Outputs::TOTAL).touches(touches);
        let options =
            Options::default().scene(scene).calibration(calibration(body)?).backend(BackendKind::Cpu).batch(BATCH);
        let mut engine = Engine::new(&of_one_field, options)?;
        engine.set_channels(&ids)?;
        let skin = engine.skin().ok_or_else(|| untouchable(body, "it has no skin"))?;
        let cells = skin.taxels().iter().filter_map(|taxel| Some((body.taxel_index(taxel.id)?, taxel.cell_m2.sqrt())));
        let sides_m: Vec<(usize, f64)> = cells.collect();
        let mean_m2 = sides_m.iter().map(|(_, side)| side * side).sum::<f64>() / sides_m.len() as f64;
        if !(mean_m2.is_finite() && mean_m2 > 0.0) {
            return Err(untouchable(body, "no taxel lies on its surface; look at it with `somatic inspect`"));
        }
        Ok(Self { body, engine, sides_m, spacing_m: mean_m2.sqrt(), frames: 0 })
    }

    /// The skin under touches of the size of `spacing_m`.
    pub(super) fn skin(&self, spacing_m: f64) -> GivenPresses {
        GivenPresses::new(self.body, &self.sides_m, SIGMA_SPACINGS * spacing_m)
    }

    /// The errors of `touches` at random places.
    pub(super) fn errors_at_random(&mut self, touches: &TestTouches) -> Result<LayoutErrors> {
        let spacing_m = touches.spacing_m.unwrap_or(self.spacing_m);
        let skin = self.skin(spacing_m);
        let presses = presses(touches.count, spacing_m, |press| skin.skin_at(press).is_some());
        self.errors(&skin, &presses, spacing_m)
    }

    /// The errors of `presses` on `skin`, of the size of `spacing_m`.
    pub(super) fn errors(
        &mut self,
        skin: &GivenPresses,
        presses: &[GivenPress],
        spacing_m: f64,
    ) -> Result<LayoutErrors> {
        if presses.is_empty() {
            return Err(untouchable(self.body, "no taxel is near its surface; look at it with `somatic inspect`"));
        }
        let mut touches = Vec::with_capacity(presses.len());
        for (call, presses) in presses.chunks(BATCH).enumerate() {
            let pressed = self.pressed(skin, presses, call * BATCH);
            let rest = vec![RawValue::new(0.0); self.sides_m.len()];
            let values = pressed.iter().flat_map(|pressed| [&pressed.values, &rest]);
            let frames: Vec<Frame> = values.map(|values| self.frame(values)).collect();
            self.engine.process(&frames)?;
            let percepts = self.engine.percepts();
            for (number, Pressed { truth, newton_at_step, .. }) in pressed.iter().enumerate() {
                let found = percepts.touches(2 * number).map_or(&[][..], |found| &found.touches);
                let most = found.iter().reduce(|most, other| if other.total > most.total { other } else { most });
                let counted = most.filter(|touch| touch.active >= MIN_TAXELS).zip(truth.as_ref());
                touches.push(counted.map(|(touch, truth)| self.error(touch, truth, *newton_at_step)));
            }
        }
        let taxels = self.sides_m.len();
        Ok(LayoutErrors { taxels, spacing_m: self.spacing_m, touch_spacing_m: spacing_m, touches })
    }

    /// What sensors read of `presses`, the first of them number `first`, and what is true.
    fn pressed(&self, skin: &GivenPresses, presses: &[GivenPress], first: usize) -> Vec<Pressed> {
        let taxels = self.sides_m.len();
        let mut pressed: Vec<Option<Pressed>> = presses.iter().map(|_| None).collect();
        let tasks = presses.iter().zip(&mut pressed).enumerate();
        parallel::for_each(parallel::threads(), tasks, |(number, (press, pressed))| {
            let mut forces_newton = vec![0.0; taxels];
            let truth = skin.press(press, &mut forces_newton);
            let most = forces_newton.iter().copied().fold(0.0, f64::max);
            let values = skin.read(&SENSORS, (first + number) as u64, &forces_newton);
            *pressed = Some(Pressed { values, truth, newton_at_step: most / STEPS });
        });
        pressed.into_iter().flatten().collect()
    }

    /// The frames of `presses`, without any at rest.
    pub(super) fn frames_of(&mut self, skin: &GivenPresses, presses: &[GivenPress]) -> Vec<Frame> {
        let pressed = self.pressed(skin, presses, 0);
        pressed.iter().map(|pressed| self.frame(&pressed.values)).collect()
    }

    /// What [`Trial::frames_of`] has values of.
    pub(super) fn ids(&self) -> Vec<u32> {
        self.sides_m.iter().map(|&(index, _)| self.body.taxels[index].id).collect()
    }

    /// The calibration of the sensors.
    pub(super) fn calibration(&self) -> Result<Calibration> {
        calibration(self.body)
    }

    fn frame(&mut self, values: &[RawValue]) -> Frame {
        let mut frame = Frame::missing(FRAME_S * f64::from(self.frames), values.len());
        self.frames += 1;
        frame.values.copy_from_slice(values);
        frame
    }

    /// How far `touch` is from `truth`, of a press of 1 N.
    fn error(&self, touch: &Touch, truth: &GivenTruth, newton_at_step: f64) -> TouchError {
        let body_from_link = self.body.links[touch.link as usize].body_from_link;
        let position = body_from_link.transform_point3(touch.position);
        let is_clear = !touch.flags.contains(TouchFlags::WRAPPED)
            && touch.anisotropy.is_some_and(|anisotropy| anisotropy >= MIN_ANISOTROPY);
        let axis = touch.principal_axis.filter(|_| is_clear).map(|axis| body_from_link.transform_vector3(axis));
        TouchError {
            place_m: position.distance(truth.position),
            axis_rad: axis.zip(truth.principal_axis).and_then(|(axis, right)| {
                // One axis lies in the plane of the taxel in the middle, the other in that of the true place.
                let base: DVec3 = self.engine.skin()?.taxels().get(touch.base as usize)?.mean_normal;
                let faces_alike = base.dot(truth.normal) > 0.0;
                faces_alike.then(|| between(turned(axis, base, truth.normal), right))
            }),
            force: touch.total * newton_at_step - 1.0,
        }
    }
}

/// The calibration of the sensors on `body`.
fn calibration(body: &Body) -> Result<Calibration> {
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let noise = NOISE * STEPS;
    let (with_rounding, dead_band) = (noise + ROUNDING, DEAD_SIGMAS * noise);
    Calibration::parse(&format!("[all]\nunit = \"N\"\nnoise = {with_rounding}\ndead_band = {dead_band}\n"), &ids)
}

/// What sensors read of a press.
struct Pressed {
    values: Vec<RawValue>,
    truth: Option<GivenTruth>,
    newton_at_step: f64,
}

/// The angle between two lines, rad.
fn between(a: DVec3, b: DVec3) -> f64 {
    libm::atan2(a.cross(b).length(), a.dot(b).abs())
}

/// `vector`, turned as the plane across `from` is turned to that across `to`, on the shortest way.
fn turned(vector: DVec3, from: DVec3, to: DVec3) -> DVec3 {
    let (axis, cos) = (from.cross(to), from.dot(to));
    vector * cos + axis.cross(vector) + axis * (axis.dot(vector) / (1.0 + cos))
}

/// That nothing on `body` could be touched.
fn untouchable(body: &Body, why: &str) -> Error {
    Error::failed(format!("errors of touches cannot be simulated: {why}")).at(&body.name)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    #[test]
    fn a_direction_is_turned_with_its_plane() {
        let tilted = DVec3::new(0.0, 0.6, 0.8);
        assert!(turned(DVec3::X, DVec3::Z, tilted).distance(DVec3::X) < 1e-12);
        assert!(turned(DVec3::Y, DVec3::Z, tilted).distance(DVec3::new(0.0, 0.8, -0.6)) < 1e-12);
        assert!((between(DVec3::X, -DVec3::Y) - FRAC_PI_2).abs() < 1e-12 && between(DVec3::X, -DVec3::X) < 1e-12);
    }
}
