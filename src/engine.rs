//! The engine: a plan, a backend and the state between frames. Frames in, percepts out; it does no I/O.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};

use crate::backend::agreement::{Agreement, compare};
use crate::backend::reference::Reference;
use crate::backend::{self, Backend, BackendKind, RawBatch, Step};
use crate::body::Body;
use crate::error::{Error, Result, nearest};
use crate::field::{FieldSet, neighbours};
use crate::percept::{Flags, Outputs, Percepts, Precision, Values};
use crate::scene::{Plan, Scene};
use crate::signal::{Calibration, Frame, Intake, RawValue};
use crate::stage::position;

/// What an engine is to do; the default is everything, uncalibrated, one frame a call, on whatever is fastest.
#[derive(Clone, Debug)]
pub struct Options {
    /// What is asked for.
    pub scene: Scene,
    /// The robot's calibration; without one P is the raw value.
    pub calibration: Option<Calibration>,
    /// What it runs on.
    pub backend: BackendKind,
    /// Frames a call, about: 1 for a live robot, some hundred for recordings. More are taken in turns.
    pub batch: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { scene: Scene::default(), calibration: None, backend: BackendKind::Auto, batch: 1 }
    }
}

/// Turns frames into percepts.
///
/// ```
/// # fn main() -> somatic::Result<()> {
/// let body = somatic::Body::from_bytes("hand.glb", somatic::bundled::HAND)?;
/// let mut engine = somatic::Engine::new(&body, somatic::Options::default())?;
/// let mut frame = engine.frame(0.0);
/// frame.values.fill(somatic::RawValue::new(0.0));
/// frame.values[engine.value_of(4).unwrap()] = somatic::RawValue::new(512.0);
/// let percepts = engine.process(&[frame])?;
/// assert!(percepts.touched(0).all(|percept| percept.total == Some(512.0)));
/// # Ok(())
/// # }
/// ```
pub struct Engine {
    plan: Plan,
    backend: Box<dyn Backend>,
    why: String,
    intake: Intake,
    raw: Vec<RawValue>,
    steps: Vec<Step>,
    last_t_s: Option<f64>,
    max_gap_s: f64,
    percepts: Percepts,
    /// Made by the first comparison, and kept, as it has a memory too.
    reference: Option<Reference>,
    frames_done: u64,
    ids: Vec<u32>,
    links: Links,
}

/// What poses are applied to: the body's links and how they hang together at rest.
struct Links {
    index_of: HashMap<String, usize>,
    parent: Vec<Option<usize>>,
    world_from_link: Vec<DAffine3>,
}

impl Engine {
    /// An engine for `body`.
    ///
    /// # Errors
    /// The body has no taxels or no fields, a field is empty, the scene asks for what is not there, or the backend that
    /// was asked for cannot run here ([`Error::is_no_adapter`]).
    pub fn new(body: &Body, options: Options) -> Result<Self> {
        let Options { scene, calibration, backend: kind, batch } = options;
        let calibration = calibration.unwrap_or_else(|| Calibration::identity(body.taxels.len()));
        if calibration.taxels.len() != body.taxels.len() {
            return Err(Error::failed(format!(
                "the calibration is for {} taxels, the body has {}; read it again for this body",
                calibration.taxels.len(),
                body.taxels.len()
            )));
        }
        let fields = FieldSet::new(body)?;
        let plan = Plan::new(body, &fields, &scene, &calibration)?;
        let chosen = backend::choose(kind, &plan, batch.max(1))?;
        let beside = if calibration.checks.isolated_ratio.is_some() { neighbours(body) } else { Vec::new() };
        Ok(Self {
            steps: Vec::new(),
            last_t_s: None,
            max_gap_s: scene.max_gap_s,
            percepts: Percepts::new(plan.outputs, plan.fields.len(), kind.precision()).with_columns(plan.columns),
            reference: None,
            backend: chosen.backend,
            why: chosen.why,
            intake: Intake::new(calibration, beside, scene.max_age_s),
            raw: Vec::new(),
            frames_done: 0,
            ids: body.taxels.iter().map(|taxel| taxel.id).collect(),
            links: Links {
                index_of: body.links.iter().enumerate().map(|(i, link)| (link.name.clone(), i)).collect(),
                parent: body.links.iter().map(|link| link.parent).collect(),
                world_from_link: body.links.iter().map(|link| link.world_from_link).collect(),
            },
            plan,
        })
    }

    /// What is run.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The backend: its name, what it runs on, and why it was chosen.
    #[must_use]
    pub fn backend(&self) -> (&'static str, String, &str) {
        (self.backend.name(), self.backend.describe(), &self.why)
    }

    /// Says which taxels a source's frames hold, in their order. Until then, it is all of the body's, by ascending id.
    ///
    /// # Errors
    /// An id that the body does not have, or one twice.
    pub fn listen(&mut self, ids: &[u32]) -> Result<()> {
        let mut taken = vec![false; self.ids.len()];
        let mut taxel_of_value = Vec::with_capacity(ids.len());
        for id in ids {
            let taxel = self.ids.binary_search(id).map_err(|_| {
                Error::failed(format!(
                    "there is a taxel id {id}, which the body does not have (its ids are {}); is it the right body?",
                    ranges(&self.ids)
                ))
            })?;
            if std::mem::replace(&mut taken[taxel], true) {
                return Err(Error::failed(format!("taxel id {id} is there twice")));
            }
            taxel_of_value.push(taxel);
        }
        self.intake.listen(taxel_of_value);
        Ok(())
    }

    /// A frame for all of the body's taxels by ascending id, every value missing.
    #[must_use]
    pub fn frame(&self, t_s: f64) -> Frame {
        Frame::missing(t_s, self.ids.len())
    }

    /// Where the taxel with `id` stands in the values of [`Engine::frame`].
    #[must_use]
    pub fn value_of(&self, id: u32) -> Option<usize> {
        self.ids.binary_search(&id).ok()
    }

    /// Turns `frames` into percepts, in order. However a recording is cut into calls, its percepts are the same bits.
    ///
    /// # Errors
    /// A frame has another number of values than the engine listens to, or poses a link that the body does not have; or
    /// the device was lost.
    pub fn process(&mut self, frames: &[Frame]) -> Result<&Percepts> {
        self.gather(frames)?;
        let raw = RawBatch { frames: frames.len(), values: &self.raw, steps: &self.steps };
        self.percepts.first_frame = self.frames_done;
        run(&mut *self.backend, &self.plan, &self.links, frames, &raw, &mut self.percepts)?;
        self.frames_done += frames.len() as u64;
        Ok(&self.percepts)
    }

    /// Does what [`Engine::process`] does, on the reference too, and compares the two by derived bounds.
    ///
    /// # Errors
    /// As [`Engine::process`]; also after frames that were not compared, as the reference has not seen them.
    pub fn process_and_compare(&mut self, frames: &[Frame]) -> Result<(&Percepts, Agreement)> {
        if self.reference.is_none() && self.frames_done > 0 {
            return Err(Error::usage("frames were processed without a comparison; compare from the first on"));
        }
        self.process(frames)?;
        let reference = self.reference.get_or_insert_with(|| Reference::new(&self.plan));
        let raw = RawBatch { frames: frames.len(), values: &self.raw, steps: &self.steps };
        let bounds = reference.bounds(&raw);
        let mut right =
            Percepts::new(self.plan.outputs, self.plan.fields.len(), Precision::F64).with_columns(self.plan.columns);
        right.first_frame = self.percepts.first_frame;
        run(reference, &self.plan, &self.links, frames, &raw, &mut right)?;
        let names: Vec<&str> = self.plan.fields.iter().map(|field| field.name.as_str()).collect();
        let agreement = compare(&right, &bounds, &self.percepts, &names);
        Ok((&self.percepts, agreement))
    }

    fn gather(&mut self, frames: &[Frame]) -> Result<()> {
        for (index, frame) in frames.iter().enumerate() {
            let at = |e: Error| e.at(format!("frame {}", self.frames_done + index as u64));
            if frame.values.len() != self.intake.width() {
                let (got, want) = (frame.values.len(), self.intake.width());
                return Err(at(Error::failed(format!("it has {got} values where {want} belong"))));
            }
            if let Some((name, _)) = frame.pose.iter().find(|(name, _)| !self.links.index_of.contains_key(name)) {
                let near = nearest(name, self.links.index_of.keys().map(String::as_str));
                let hint = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
                return Err(at(Error::failed(format!("it poses link `{name}`, which the body does not have{hint}"))));
            }
        }
        self.raw.clear();
        for frame in frames {
            self.intake.take(frame, &self.plan.body_taxels, &mut self.raw);
        }
        self.steps.clear();
        for frame in frames {
            self.steps.push(step(self.last_t_s, frame.t_s, self.max_gap_s));
            self.last_t_s = Some(frame.t_s);
        }
        Ok(())
    }
}

/// The time from the frame at `last_t_s` to the one at `t_s`, and whether motion can be measured over it.
fn step(last_t_s: Option<f64>, t_s: f64, max_gap_s: f64) -> Step {
    let Some(last_t_s) = last_t_s else { return Step { dt_s: 0.0, flags: Flags::NO_PREVIOUS } };
    let dt_s = t_s - last_t_s;
    // A step too short for single precision is none.
    let usable = dt_s > SHORTEST_STEP_S && dt_s <= max_gap_s;
    Step { dt_s, flags: if usable { Flags::empty() } else { Flags::BAD_DT } }
}

/// Speeds over shorter steps could pass what single precision holds.
const SHORTEST_STEP_S: f64 = 1e-12;

/// The part of a call that does not change the engine: a backend, then what the host adds.
fn run(
    backend: &mut dyn Backend,
    plan: &Plan,
    links: &Links,
    frames: &[Frame],
    raw: &RawBatch<'_>,
    percepts: &mut Percepts,
) -> Result<()> {
    percepts.reset(frames.len());
    backend.run(raw, percepts)?;
    for (index, frame) in frames.iter().enumerate() {
        percepts.t_s[index] = frame.t_s;
    }
    if plan.stages().position {
        for (index, frame) in frames.iter().enumerate() {
            place(plan, links, frame, index, percepts);
        }
    }
    Ok(())
}

/// Puts the centroids of one frame on the surface, and into the world where the frame says where that is.
fn place(plan: &Plan, links: &Links, frame: &Frame, index: usize, percepts: &mut Percepts) {
    for (number, field) in plan.fields.iter().enumerate() {
        let cell = index * plan.fields.len() + number;
        if percepts.flags[cell].contains(Flags::NO_CONTACT) {
            continue;
        }
        let place = match &percepts.values {
            Values::F32(columns) => DVec3::from_array(columns.centroid[cell].map(f64::from)),
            Values::F64(columns) => DVec3::from_array(columns.centroid[cell]),
        };
        let (mut position, mut normal) = match (&field.chart, &field.lift) {
            (Some(chart), Some(lift)) => position::on_surface(chart, lift, field.origin_in_anchor, place.truncate()),
            _ => (field.origin_in_anchor + place, DVec3::ZERO),
        };
        if let Some(world_from_anchor) = field.anchor.and_then(|anchor| links.world_from(anchor, frame)) {
            position = world_from_anchor.transform_point3(position);
            normal = world_from_anchor.transform_vector3(normal);
            percepts.in_world[cell] = true;
        }
        if plan.outputs.contains(Outputs::POSITION) {
            percepts.position[cell] = position.to_array();
        }
        if plan.outputs.contains(Outputs::NORMAL) {
            percepts.normal[cell] = normal.to_array();
        }
    }
}

impl Links {
    /// world_from_link of `link` in `frame`: its own pose, or that of its nearest ancestor that has one, at rest from
    /// there on. `None` where the frame poses neither.
    fn world_from(&self, link: usize, frame: &Frame) -> Option<DAffine3> {
        if frame.pose.is_empty() {
            return None;
        }
        let mut at = Some(link);
        while let Some(ancestor) = at {
            let posed = frame.pose.iter().find(|(name, _)| self.index_of.get(name) == Some(&ancestor));
            if let Some((_, pose)) = posed {
                let world_from_ancestor = DAffine3::from_rotation_translation(pose.rotation, pose.translation);
                let ancestor_from_link = self.world_from_link[ancestor].inverse() * self.world_from_link[link];
                return Some(world_from_ancestor * ancestor_from_link);
            }
            at = self.parent[ancestor];
        }
        None
    }
}

/// Ascending ids in few words: `0–35, 64–103`.
fn ranges(ids: &[u32]) -> String {
    let mut words: Vec<String> = Vec::new();
    let mut start = 0;
    for end in 1..=ids.len() {
        if end == ids.len() || ids[end] != ids[end - 1] + 1 {
            let (first, last) = (ids[start], ids[end - 1]);
            words.push(if first == last { first.to_string() } else { format!("{first}–{last}") });
            start = end;
        }
    }
    if words.len() > 6 {
        words.truncate(5);
        words.push("…".into());
    }
    words.join(", ")
}
