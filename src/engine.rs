//! The engine: a plan, a backend and the state between frames. Frames in, percepts out; it does no I/O.

mod cadence;
mod check;
mod host;
mod ids;
mod kept_up;
mod place;

use std::ops::Range;

use self::cadence::{OnChange, step};
use self::check::Check;
use self::host::{Host, Side, flag_stale};
use self::ids::ranges;
use self::kept_up::KeptUp;
use self::place::Links;
use crate::backend::agreement::{Agreement, compare};
use crate::backend::{self, Backend, BackendKind, Picks, RawBatch, Rows, Step};
use crate::body::Body;
use crate::error::{Error, Result, nearest};
use crate::field::{FieldSet, NoChart, Recharted, neighbours};
use crate::percept::Percepts;
use crate::scene::{Cadence, Coordinates, Plan, Scene};
use crate::signal::{Calibration, Frame, Intake, RawValue, Receptor, Unfit, Wiring};
use crate::stage::calibrate;

/// What an engine is to do; the default is everything, uncalibrated, one frame a call, on whatever is fastest.
#[derive(Clone, Debug)]
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

impl Default for Options {
    fn default() -> Self {
        Self { scene: Scene::default(), calibration: None, backend: BackendKind::Auto, tare: false, batch: 1 }
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
/// frame.values[engine.index_of_taxel(4).unwrap()] = somatic::RawValue::new(512.0);
/// let percepts = engine.process_one(&frame)?;
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
    /// Where frames have the plan's values, if those pass as they are; `raw` stays empty then.
    picks: Option<Picks>,
    steps: Vec<Step>,
    last_t_s: Option<f64>,
    max_gap_s: f64,
    percepts: Percepts,
    /// Made by the first comparison, and kept, as the reference has a memory too.
    check: Option<Box<Check>>,
    /// What the calibration's upkeep does, if it does anything.
    upkeep: Option<KeptUp>,
    /// What is remembered of frames before.
    side: Side,
    /// Which fields changed, where that is looked at.
    cadence: Option<OnChange>,
    /// Whether the first frame is still to be taken as the baselines.
    tare: bool,
    frames_done: u64,
    ids: Vec<u32>,
    links: Links,
    /// Fields that could not have the kind of chart that is asked for.
    kept_charts: Vec<(String, NoChart)>,
}

impl Engine {
    /// An engine for `body`.
    ///
    /// # Errors
    /// The body has no taxels or no fields, a field is empty, the scene asks for what is not there, or the backend that
    /// was asked for cannot run here ([`Error::is_no_adapter`]).
    pub fn new(body: &Body, options: Options) -> Result<Self> {
        let scene = &options.scene;
        let recharted = scene.knobs.charts.applied(body, FieldSet::new(body)?, &scene.fields)?;
        Self::in_charts(body, recharted, options)
    }

    /// [`Engine::new`] with the fields in the charts that the scene asks for, which take seconds to lay on some bodies.
    pub(crate) fn in_charts(body: &Body, recharted: Recharted, options: Options) -> Result<Self> {
        let Options { scene, calibration, backend: kind, tare, batch } = options;
        let kind = kind.with(scene.knobs.arithmetic)?;
        let calibration = calibration.unwrap_or_else(|| Calibration::identity(body.taxels.len()));
        if calibration.taxels.len() != body.taxels.len() {
            return Err(Error::failed(format!(
                "the calibration is for {} taxels, the body has {}; read it again for this body",
                calibration.taxels.len(),
                body.taxels.len()
            )));
        }
        let plan = Plan::new(body, &recharted.fields, &scene, &calibration)?;
        // Of a large skin these take as much memory as the plan.
        drop(recharted.fields);
        let upkeep = KeptUp::new(&plan, calibration.upkeep, body);
        if upkeep.is_some() && plan.letters().iter().all(|letter| letter.receptor != Receptor::Sustained) {
            return Err(Error::usage(
                "the calibration's [upkeep] must know what is touched; ask for letter `sustained` too",
            ));
        }
        let chosen = backend::choose(kind, &plan, batch.max(1))?;
        let beside = if calibration.checks.isolated_ratio.is_some() { neighbours(body) } else { Vec::new() };
        let mut engine = Self {
            steps: Vec::new(),
            last_t_s: None,
            max_gap_s: scene.max_gap_s,
            percepts: Percepts::new(plan.outputs, plan.fields.len(), kind.precision())
                .with_columns(plan.columns, plan.kept_pressures())
                .with_letters(plan.letters().len())
                .with_names((0..plan.fields.len()).map(|field| plan.label(field)).collect()),
            check: None,
            upkeep,
            side: Side::new(plan.fields.len()),
            cadence: (scene.knobs.cadence == Cadence::OnChange).then(|| OnChange::new(&plan, scene.max_gap_s)),
            backend: chosen.backend,
            why: chosen.why,
            intake: Intake::new(calibration, beside, scene.max_age_s),
            raw: Vec::new(),
            picks: None,
            tare,
            frames_done: 0,
            ids: body.taxels.iter().map(|taxel| taxel.id).collect(),
            links: Links {
                posed: scene.coordinates == Coordinates::World,
                index_of: body.links.iter().enumerate().map(|(i, link)| (link.name.clone(), i)).collect(),
                parent: body.links.iter().map(|link| link.parent).collect(),
                world_from_link: body.links.iter().map(|link| link.world_from_link).collect(),
            },
            kept_charts: recharted.kept,
            plan,
        };
        engine.pick();
        Ok(engine)
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

    /// Fields that stay in the charts of the layout as they cannot have the kind that [`crate::scene::Knobs::charts`]
    /// asks for, and why.
    pub fn kept_charts(&self) -> impl ExactSizeIterator<Item = (&str, &NoChart)> {
        self.kept_charts.iter().map(|(name, why)| (name.as_str(), why))
    }

    /// Says which taxels a source's frames hold, in their order. Until then, it is all of the body's, by ascending id.
    ///
    /// # Errors
    /// An id that the body does not have, or one twice.
    pub fn set_channels(&mut self, ids: &[u32]) -> Result<()> {
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
        self.intake.set_channels(taxel_of_value);
        self.pick();
        Ok(())
    }

    /// From now on, fields that hold a taxel whose value is [`RawValue::STALE`] carry [`crate::Flags::STALE`] beside
    /// [`crate::Flags::INCOMPLETE`]. For sources that say so; it costs a look at every value.
    pub fn track_stale(&mut self) {
        self.intake.track_stale();
        self.pick();
    }

    /// Tells which board each taxel hangs on: from now on, the drift of one that is touched is that of its board's
    /// untouched taxels, where there are three. Without, it is that of its link's, else of the body's. For before the first
    /// frame.
    pub fn wire(&mut self, wiring: &Wiring) {
        if let Some(kept) = &mut self.upkeep {
            kept.wire(&self.plan, wiring, |channel| self.ids[self.plan.body_taxels[channel]]);
        }
    }

    /// Finds out whether values can be read where they are. Upkeep looks at all of them, gathered.
    fn pick(&mut self) {
        let picks = self.intake.picks(&self.plan.body_taxels).filter(|picks| !picks.is_empty());
        let (width, calibrated) = (self.intake.width(), self.plan.calibrated());
        self.picks = picks.filter(|_| self.upkeep.is_none()).map(|picks| Picks::new(&picks, calibrated, width));
    }

    /// A frame for all of the body's taxels by ascending id, every value missing.
    #[must_use]
    pub fn frame(&self, t_s: f64) -> Frame {
        Frame::missing(t_s, self.ids.len())
    }

    /// Where the taxel with `id` stands in the values of [`Engine::frame`].
    #[must_use]
    pub fn index_of_taxel(&self, id: u32) -> Option<usize> {
        self.ids.binary_search(&id).ok()
    }

    /// Turns `frames` into percepts, in order. However a recording is cut into calls, its percepts are the same bits.
    ///
    /// # Errors
    /// A frame has another number of values than the engine listens to, or poses a link that the body does not have; or
    /// the device was lost.
    pub fn process(&mut self, frames: &[Frame]) -> Result<&Percepts> {
        self.advance(frames, None)?;
        Ok(&self.percepts)
    }

    /// The same for one frame, as on a live robot.
    ///
    /// # Errors
    /// As [`Engine::process`].
    pub fn process_one(&mut self, frame: &Frame) -> Result<&Percepts> {
        self.process(std::slice::from_ref(frame))
    }

    /// What the last call gave.
    #[must_use]
    pub fn percepts(&self) -> &Percepts {
        &self.percepts
    }

    /// Puts into `to`, in place of what it holds, the taxels of the plan by id and their pressures in `frame`, as far as
    /// these are known: to look at, in double precision and without what only a run of frames can tell, such as values that
    /// are held.
    pub fn pressures(&self, frame: &Frame, to: &mut Vec<(u32, f64)>) {
        to.clear();
        for (&taxel, &value) in self.intake.taxel_of_value().iter().zip(&frame.values) {
            let Ok(channel) = self.plan.body_taxels.binary_search(&taxel) else { continue };
            let curve = self.plan.curves.of(self.plan.taxels[channel].response);
            let pressure = calibrate::reference(value, &self.plan.calibrations[channel], curve);
            if pressure.status & calibrate::UNUSABLE == 0 {
                to.push((self.ids[taxel], pressure.value));
            }
        }
    }

    /// Does what [`Engine::process`] does, on the reference too, and compares the two by derived bounds.
    ///
    /// # Errors
    /// As [`Engine::process`]; also after frames that were not compared, as the reference has not seen them.
    pub fn process_and_compare(&mut self, frames: &[Frame]) -> Result<(&Percepts, Agreement)> {
        let mut check = match self.check.take() {
            Some(check) => check,
            None if self.frames_done > 0 => {
                return Err(Error::usage("frames were processed without a comparison; compare from the first on"));
            }
            None => Box::new(Check::new(&self.plan)),
        };
        let done = self.advance(frames, Some(&mut check));
        let names: Vec<String> = (0..self.plan.fields.len()).map(|field| self.plan.label(field)).collect();
        let agreement = done.map(|()| compare(&check.right, &check.bounds, &self.percepts, &names));
        self.check = Some(check);
        Ok((&self.percepts, agreement?))
    }

    /// Taxels that are not used at present, by id, and why: those that upkeep has found unfit.
    pub fn unfit(&self) -> impl Iterator<Item = (u32, Unfit)> + '_ {
        let judged = self.upkeep.iter().flat_map(|kept| kept.upkeep.taxels());
        judged.zip(&self.plan.body_taxels).filter_map(|((_, unfit), &taxel)| Some((self.ids[taxel], unfit?)))
    }

    /// All of `frames`, epoch by epoch where there is upkeep, on the backend and, if asked for, on the reference.
    fn advance(&mut self, frames: &[Frame], mut check: Option<&mut Check>) -> Result<()> {
        self.gather(frames)?;
        self.percepts.reset(frames.len());
        self.percepts.first_frame = self.frames_done;
        if let Some(check) = check.as_deref_mut() {
            check.right.reset(frames.len());
            check.right.first_frame = self.frames_done;
            check.bounds.clear();
        }
        if self.tare && !frames.is_empty() {
            self.tare = false;
            self.take_as_baselines(&frames[0], check.as_deref_mut());
        }
        let mut start = 0;
        for index in 0..frames.len() {
            if self.upkeep.as_ref().is_some_and(|kept| kept.upkeep.is_due(frames[index].t_s)) {
                self.segment(frames, start..index, check.as_deref_mut())?;
                self.close_epoch(check.as_deref_mut());
                start = index;
            }
            if let Some(kept) = &mut self.upkeep {
                let channels = self.plan.channels();
                kept.upkeep.observe(frames[index].t_s, &self.raw[index * channels..][..channels]);
            }
        }
        self.segment(frames, start..frames.len(), check.as_deref_mut())?;
        for percepts in [Some(&mut self.percepts), check.map(|check| &mut check.right)].into_iter().flatten() {
            flag_stale(&self.plan, self.intake.stale(), percepts);
        }
        self.frames_done += frames.len() as u64;
        Ok(())
    }

    /// Calibrates from now on with the first gathered frame as the baselines; where it has no number, the file's stays.
    fn take_as_baselines(&mut self, first: &Frame, check: Option<&mut Check>) {
        let made = self.plan.taxels.clone();
        let channels = self.plan.channels();
        let first = rows(self.picks.as_ref(), &self.raw, std::slice::from_ref(first), channels);
        for (channel, value) in first.row(0).enumerate() {
            if let Some(value) = value.number() {
                self.plan.keep_up(channel, value as f32, false, &made);
            }
        }
        if let Some(kept) = &mut self.upkeep {
            kept.restart(&self.plan);
        }
        self.backend.recalibrate(&self.plan);
        if let Some(cadence) = &mut self.cadence {
            cadence.forget();
        }
        if let Some(check) = check {
            check.reference.recalibrate(&self.plan);
        }
    }

    /// A run of frames that are calibrated alike.
    fn segment(&mut self, frames: &[Frame], range: Range<usize>, check: Option<&mut Check>) -> Result<()> {
        if range.is_empty() {
            return Ok(());
        }
        let channels = self.plan.channels();
        let raw = RawBatch {
            first: range.start,
            frames: range.len(),
            rows: rows(self.picks.as_ref(), &self.raw, frames, channels).part(range.clone()),
            steps: &self.steps[range.clone()],
        };
        if let Some(cadence) = &mut self.cadence {
            cadence.look(&raw, &frames[range.clone()]);
        }
        let host = Host { plan: &self.plan, links: &self.links, cadence: self.cadence.as_ref() };
        let (backend, percepts, side) = (&mut *self.backend, &mut self.percepts, &mut self.side);
        let right = match check {
            None => {
                host.run(backend, &frames[range.clone()], &raw, percepts, side)?;
                None
            }
            Some(check) => {
                check.run(&host, backend, &frames[range.clone()], &raw, percepts, side)?;
                Some(&mut check.right)
            }
        };
        if let Some(kept) = &mut self.upkeep {
            let cells = range.start * self.plan.fields.len()..range.end * self.plan.fields.len();
            kept.note(&self.percepts.flags[cells.clone()]);
            kept.flag(&mut self.percepts.flags[cells.clone()]);
            right.into_iter().for_each(|right| kept.flag(&mut right.flags[cells.clone()]));
        }
        Ok(())
    }

    /// Lets upkeep judge the epoch, and calibrates from now on as it says.
    fn close_epoch(&mut self, check: Option<&mut Check>) {
        let Some(kept) = &mut self.upkeep else { return };
        if kept.close(&mut self.plan) {
            self.backend.recalibrate(&self.plan);
            if let Some(cadence) = &mut self.cadence {
                cadence.forget();
            }
            if let Some(check) = check {
                check.reference.recalibrate(&self.plan);
            }
        }
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
        self.intake.forget_stale();
        if self.picks.is_none() {
            for frame in frames {
                self.intake.take(frame, &self.plan.body_taxels, &mut self.raw);
            }
        }
        self.steps.clear();
        for frame in frames {
            self.steps.push(step(self.last_t_s, frame.t_s, self.max_gap_s));
            self.last_t_s = Some(frame.t_s);
        }
        Ok(())
    }
}

/// Where the values of `frames` lie: where `picks` says, or gathered in `raw`.
fn rows<'a>(picks: Option<&'a Picks>, raw: &'a [RawValue], frames: &'a [Frame], channels: usize) -> Rows<'a> {
    match picks {
        Some(picks) => Rows::Picked { frames, picks },
        None => Rows::Packed { values: raw, channels },
    }
}
