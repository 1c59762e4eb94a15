//! The engine: a plan, a backend and the state between frames. Frames in, percepts out; it does no I/O.

mod advance;
mod block;
mod cadence;
mod check;
mod dominated;
mod drift_state;
mod ids;
mod input;
mod letter_cell;
mod letters;
mod links;
mod on_skin;
mod options;
mod place;
mod post;
mod pulls;
mod self_contacts;
mod skin_fits;
mod skin_sigmas;
mod spread;
mod state;
mod touch_check;
mod touch_senses;
mod touch_warmth;

use self::cadence::OnChange;
use self::check::Check;
use self::drift_state::DriftState;
use self::ids::{checked_by_pressure, no_channel, taxels_of, with_codes_of_senses};
use self::input::Input;
use self::links::Links;
use self::on_skin::OnSkin;
pub use self::options::{ChosenBackend, Options};
use self::post::PostState;
pub use self::state::EngineState;
use crate::backend::agreement::{Agreement, ComparedColumn, compare, compare_columns};
use crate::backend::{self, Backend, Picks, Step};
use crate::body::Body;
use crate::error::{Error, Result};
use crate::field::{FieldSet, NoChart, Recharted, neighbours};
use crate::percept::{LinkShare, Percepts};
use crate::scene::{Cadence, Plan};
use crate::signal::{Axis, Calibration, Channel, Frame, FrameTime, Intake, RawValue, Receptor, Unfit, Wiring};
use crate::stage::{Pressed, calibrate};
use crate::touch::Skin;

/// Turns frames into percepts.
///
/// ```
/// # mod somatic { pub use somatic_bodies as bundled; pub use somatic_engine::{Engine, Options, percept::TouchFrame, scene::Scene, touch}; pub use somatic_skin::{body::Body, error::Result, signal, signal::RawValue}; }
/// # fn main() -> somatic::Result<()> {
/// let body = somatic::Body::from_bytes("hand.glb", somatic::bundled::HAND)?;
/// let mut engine = somatic::Engine::new(&body, somatic::Options::default())?;
/// let mut frame = engine.frame(0.0);
/// frame.values.fill(somatic::RawValue::new(0.0));
/// engine.set_value(&mut frame, 4, 512.0_f32)?;
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
    /// The values that letters are made of which the host makes, frame by frame.
    sensed: Vec<RawValue>,
    /// Where those are in a frame whose values pass as they are.
    sensed_at: Vec<Option<u32>>,
    /// Where frames have the plan's values, if those pass as they are; `raw` stays empty then.
    picks: Option<Picks>,
    steps: Vec<Step>,
    last_time: Option<FrameTime>,
    max_gap_s: f64,
    percepts: Percepts,
    /// The reference's side of the last comparison, if no frame was processed without one since.
    check: Option<Box<Check>>,
    /// If the calibration asks for any drift compensation.
    drift: Option<DriftState>,
    post: PostState,
    /// With cadence `on-change`.
    cadence: Option<OnChange>,
    /// Whether the first frame is still to be taken as the baselines.
    tare: bool,
    /// Whether the calibration may change while the engine runs, by drift compensation or tare.
    recalibrates: bool,
    frames_done: u64,
    /// Times and poses of frames that came in one slice, for the next such call.
    heads: Vec<Frame>,
    ids: Vec<u32>,
    /// Per taxel of the body its channel of the plan, if it has one.
    channel_of_taxel: Vec<Option<u32>>,
    links: Links,
    /// Memory for the pressed taxels of a field, empty between calls.
    pressed: Vec<Pressed>,
    /// Where touches of the whole body are asked for.
    on_skin: Option<OnSkin>,
    /// Fields that could not have the kind of chart that is asked for.
    kept_charts: Vec<(String, NoChart)>,
}

impl std::fmt::Debug for Engine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let fields = self.plan.fields.len();
        f.debug_struct("Engine").field("backend", &self.backend()).field("fields", &fields).finish_non_exhaustive()
    }
}

impl Engine {
    /// An engine for `body`.
    ///
    /// # Errors
    /// The body has no taxels or no fields, a field is empty, the scene asks for what is not there, or the backend that
    /// was asked for cannot run here ([`ErrorKind::NoAdapter`](crate::error::ErrorKind::NoAdapter)).
    pub fn new(body: &Body, options: Options) -> Result<Self> {
        let scene = &options.scene;
        let recharted = scene.knobs.charts.applied(body, FieldSet::new(body)?, &scene.fields)?;
        Self::in_charts(body, recharted, options)
    }

    /// [`Engine::new`] with the fields in the charts that the scene asks for, which take seconds to lay on some bodies.
    #[doc(hidden)]
    pub fn in_charts(body: &Body, recharted: Recharted, options: Options) -> Result<Self> {
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
        let channels = Channel::all_of(body);
        let drift = DriftState::new(&plan, calibration.drift, body);
        if drift.is_some() && plan.letters().iter().all(|letter| letter.receptor != Receptor::Sustained) {
            return Err(Error::usage(
                "the calibration's [drift] must know what is touched; ask for letter `sustained` too",
            ));
        }
        let chosen = backend::choose(kind, &plan, batch.max(1))?;
        let layer = calibration.layer;
        let calibration = with_codes_of_senses(body, checked_by_pressure(body, calibration));
        let beside = if calibration.checks.isolated_ratio.is_some() { neighbours(body) } else { Vec::new() };
        let mut engine = Self {
            steps: Vec::new(),
            last_time: None,
            max_gap_s: scene.max_gap_s,
            percepts: Percepts::new(plan.outputs, plan.fields.len(), kind.precision())
                .with_columns(plan.columns, plan.kept_pressures())
                .with_letters(plan.letter_by_field())
                .with_touch_frames(plan.touched_from.is_some())
                .with_names((0..plan.fields.len()).map(|field| plan.label(field)).collect()),
            check: None,
            post: PostState::initial(&plan),
            recalibrates: drift.is_some() || tare,
            drift,
            cadence: (scene.knobs.cadence == Cadence::OnChange).then(|| OnChange::new(&plan, scene.max_gap_s)),
            backend: chosen.backend,
            why: chosen.why,
            intake: Intake::new(calibration, beside, scene.max_age_s, taxels_of(body, &channels)),
            raw: Vec::new(),
            sensed: Vec::new(),
            sensed_at: Vec::new(),
            picks: None,
            tare,
            frames_done: 0,
            heads: Vec::new(),
            channel_of_taxel: (0..channels.len())
                .map(|taxel| plan.body_taxels.binary_search(&taxel).ok().and_then(|channel| channel.try_into().ok()))
                .collect(),
            ids: channels,
            links: Links::new(body, &scene),
            pressed: Vec::with_capacity(
                plan.fields.iter().map(|field| plan.members_of(field).len()).max().unwrap_or(0),
            ),
            on_skin: OnSkin::new(body, &plan, &scene, layer),
            kept_charts: recharted.kept,
            plan,
        };
        if let (Some(drift), Some(on_skin)) = (&mut engine.drift, &engine.on_skin) {
            drift.follow_touches(on_skin.skin(), layer.map(|layer| layer.sigma_m));
        }
        engine.pick();
        Ok(engine)
    }

    /// What is run.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Which backend computes.
    #[must_use]
    pub fn backend(&self) -> ChosenBackend<'_> {
        ChosenBackend { name: self.backend.name(), device: self.backend.describe(), reason: &self.why }
    }

    /// Fields that stay in the charts of the layout as they cannot have the kind that [`crate::scene::Knobs::charts`]
    /// asks for, and why.
    pub fn kept_charts(&self) -> impl ExactSizeIterator<Item = (&str, &NoChart)> {
        self.kept_charts.iter().map(|(name, why)| (name.as_str(), why))
    }

    /// Says which taxels a source's frames hold, in their order: by id, and the tangential values of those with three axes by
    /// [`Channel`]. Until then, it is all of the body's, ascending.
    ///
    /// # Errors
    /// An id that the body does not have, or one twice.
    pub fn set_channels(&mut self, ids: &[u32]) -> Result<()> {
        let mut taken = vec![false; self.ids.len()];
        let mut taxel_of_value = Vec::with_capacity(ids.len());
        for id in ids {
            let taxel = self.ids.binary_search(id).map_err(|_| no_channel(Channel(*id), self.taxel_ids()))?;
            if std::mem::replace(&mut taken[taxel], true) {
                return Err(Error::failed(format!("taxel id {} appears twice", Channel(*id))));
            }
            taxel_of_value.push(taxel);
        }
        self.intake.set_channels(taxel_of_value);
        self.pick();
        Ok(())
    }

    /// From now on, fields that hold a taxel whose value is [`RawValue::STALE`] carry [`Flags::STALE`](crate::percept::Flags::STALE) beside
    /// [`Flags::INCOMPLETE`](crate::percept::Flags::INCOMPLETE). For sources that say so; it costs a look at every value.
    pub fn track_stale(&mut self) {
        self.intake.track_stale();
        self.pick();
    }

    /// From now on [`TouchFrame::taxels`](crate::percept::TouchFrame::taxels) has the taxels of touches, whatever
    /// [`Scene::touches`](crate::scene::Scene::touches) asks for, if `are_kept`. For pages, which show them.
    pub fn keep_touch_taxels(&mut self, are_kept: bool) {
        self.on_skin.iter_mut().filter(|_| are_kept).for_each(OnSkin::keep_taxels);
    }

    /// Sets the board of each taxel: from now on, the drift of one that is touched is that of its board's
    /// untouched taxels, where there are three. Without, it is that of its link's, else of the body's. For before the first
    /// frame.
    pub fn wire(&mut self, wiring: &Wiring) {
        if let Some(kept) = &mut self.drift {
            kept.wire(&self.plan, wiring, |channel| self.ids[self.plan.body_taxels[channel]]);
        }
    }

    /// Finds out whether values can be read where they are. Drift compensation looks at all of them, gathered.
    fn pick(&mut self) {
        let picks = self.intake.picks(&self.plan.body_taxels).filter(|picks| !picks.is_empty());
        let (width, calibrated) = (self.intake.width(), self.plan.calibrated());
        self.picks = picks.filter(|_| self.drift.is_none()).map(|picks| Picks::new(&picks, calibrated, width));
        self.sensed_at = self.intake.places(&self.plan.senses.channels);
    }

    /// The ids of the body's taxels, ascending.
    fn taxel_ids(&self) -> &[u32] {
        let taxels = self.ids.partition_point(|&id| Channel(id).axis() == Axis::Normal);
        &self.ids[..taxels]
    }

    /// A frame for all of the body's taxels by ascending id, then for the tangential values of those with three axes
    /// ([`Channel::all_of`]), every value missing.
    #[must_use]
    pub fn frame(&self, t_s: f64) -> Frame {
        Frame::missing(t_s, self.ids.len())
    }

    /// The index of the taxel with `id`, or of a [`Channel`], in the values of [`Engine::frame`].
    #[must_use]
    pub fn index_of_taxel(&self, id: u32) -> Option<usize> {
        self.ids.binary_search(&id).ok()
    }

    /// The index of the value called `name` in those of [`Engine::frame`]: a taxel's id, such as `4`, or of one with three axes
    /// `4.u` and `4.v`, its forces along t and n × t.
    #[must_use]
    pub fn index_of(&self, name: &str) -> Option<usize> {
        self.ids.binary_search(&Channel::named(name)?.0).ok()
    }

    /// Sets the value of the taxel with `id` in `frame`, which is one of [`Engine::frame`].
    ///
    /// # Errors
    /// The body has no such taxel, or `frame` is of other taxels.
    pub fn set_value(&self, frame: &mut Frame, id: u32, value: impl Into<RawValue>) -> Result<()> {
        let index = self
            .index_of_taxel(id)
            .ok_or_else(|| failed!("the body has no taxel {id}; its taxels are in `Body::taxels`"))?;
        let (expected, count) = (self.ids.len(), frame.values.len());
        let place = frame.values.get_mut(index).filter(|_| count == expected);
        *place.ok_or_else(|| failed!("the frame has {count} values, and the engine's have {expected}"))? = value.into();
        Ok(())
    }

    /// Remarks before the first frame, a line each: taxels that no letter reads, drift that no taxel can tell, edges
    /// between taxels that are not those of the body's file, and sensors of unknown area.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        let drift = self.drift.as_ref().is_some_and(|kept| kept.cannot_tell_drift(&self.plan)).then(|| {
            "no taxel can tell the drift of a touched field: fewer than 3 are in other fields. While a touch lasts, baselines stay, \
             and drift counts as pressure; give the body more fields, or leave `time_constant_s` of [drift] out"
                .to_owned()
        });
        let on_skin = self.on_skin.iter().flat_map(OnSkin::remarks).cloned();
        self.plan.left_out.remark().into_iter().chain(drift).chain(on_skin).collect()
    }

    /// The skin that touches of the whole body are found on; `None` unless [`Scene::touches`](crate::scene::Scene::touches) asks for them.
    /// Its nodes are what [`TouchFrame::taxels`](crate::percept::TouchFrame::taxels) counts.
    #[must_use]
    pub fn skin(&self) -> Option<&Skin> {
        self.on_skin.as_ref().map(OnSkin::skin)
    }

    /// Puts into `to`, in place of what it holds, what pressed on each link in the last frame, whatever touches it is of, in the body's
    /// order: its total, and its wrench in the link's frame. A controller takes this off what it measures. The wrench is absent, as a
    /// part would pass for the whole, if a pressed taxel has no unit or no area, or has three axes and a tangential value that is
    /// missing, faulty or out of range. Of touches that are asked for their shear or wrench, flags say which.
    /// Nothing unless [`Scene::touches`](crate::scene::Scene::touches) asks for touches.
    ///
    /// ```
    /// # mod somatic { pub use somatic_bodies as bundled; pub use somatic_engine::{Engine, Options, percept::TouchFrame, scene::Scene, touch}; pub use somatic_skin::{body::Body, error::Result, signal, signal::RawValue}; }
    /// # fn main() -> somatic::Result<()> {
    /// use somatic::{Body, Engine, Options, RawValue, Scene, bundled, touch};
    ///
    /// let body = Body::from_bytes("hand", bundled::HAND)?;
    /// let scene = Scene::default().touches(touch::Options::default());
    /// let mut engine = Engine::new(&body, Options::default().scene(scene))?;
    /// let mut frame = engine.frame(0.0);
    /// frame.values.fill(RawValue::new(0.0));
    /// engine.set_value(&mut frame, 4, 5.0_f32)?;
    /// engine.process_one(&frame)?;
    /// let mut presses = Vec::new();
    /// engine.presses_on_links(&mut presses);
    /// // Counts are not newtons: there is no wrench.
    /// assert!(presses[0].total == 5.0 && presses[0].wrench.is_none());
    /// # Ok(())
    /// # }
    /// ```
    pub fn presses_on_links(&self, to: &mut Vec<LinkShare>) {
        to.clear();
        if let Some(on_skin) = &self.on_skin {
            on_skin.on_links(&self.plan, to);
        }
    }

    /// What has changed since about how percepts are computed, to be said once: a GPU that [`BackendKind::Auto`](crate::BackendKind::Auto)
    /// had chosen was lost, and the CPU goes on.
    pub fn notice(&mut self) -> Option<String> {
        self.backend.notice()
    }

    /// Turns `frames` into percepts, in order. However a recording is cut into calls, its percepts are the same bits.
    ///
    /// # Errors
    /// A frame has another number of values than the engine listens to, or poses a link that the body does not have; or
    /// the device was lost.
    pub fn process(&mut self, frames: &[Frame]) -> Result<&Percepts> {
        self.check = None;
        self.advance(Input::from_frames(frames), None, None)?;
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
        for (place, &taxel) in self.intake.taxel_of_value().iter().enumerate().take(frame.values.len()) {
            let Some(channel) = self.channel_of_taxel[taxel].map(|channel| channel as usize) else { continue };
            let curve = self.plan.curves.table(self.plan.taxels[channel].response);
            let value = self.intake.read_alone(place, &frame.values);
            let pressure = calibrate::pressure(value, &self.plan.calibrations[channel], curve);
            to.extend(pressure.map(|pressure| (self.ids[taxel], pressure)));
        }
    }

    /// The values that the last frame's percepts were made of, by the plan's channels (ascending taxel id), where they may
    /// differ from the frame's own: values that were held, or rejected as faulty. `None` where every value passes unchanged.
    #[must_use]
    pub fn values_read(&self) -> Option<&[RawValue]> {
        let channels = self.plan.channels();
        self.picks.is_none().then(|| &self.raw[self.raw.len().saturating_sub(channels)..])
    }

    /// Does what [`Engine::process`] does, on the reference too, and compares the two by derived bounds. After frames that
    /// were not compared, and after [`Engine::restore`], the reference goes on from the backend's state.
    ///
    /// # Errors
    /// As [`Engine::process`].
    pub fn process_and_compare(&mut self, frames: &[Frame]) -> Result<(&Percepts, Agreement)> {
        let mut check = match self.check.take() {
            Some(check) => check,
            None => Box::new(Check::new(&self.plan, &self.backend.state()?, &self.post)?),
        };
        self.advance(Input::from_frames(frames), Some(&mut check), None)?;
        let names: Vec<String> = (0..self.plan.fields.len()).map(|field| self.plan.label(field)).collect();
        let mut agreement = compare(&check.right, &check.bounds, &self.percepts, &names);
        if let Some(touches) = &mut check.touches {
            agreement.merge(touches.found());
        }
        self.check = Some(check);
        Ok((&self.percepts, agreement))
    }

    /// The outputs of field `field` in frame `frame` of the last call, beside the reference's; none unless that call was
    /// [`Engine::process_and_compare`].
    #[must_use]
    pub fn compared(&self, frame: usize, field: usize) -> Vec<ComparedColumn> {
        let Some(check) = &self.check else { return Vec::new() };
        let bound = &check.bounds[frame * self.plan.fields.len() + field];
        compare_columns(&check.right.get(frame, field), bound, &self.percepts.get(frame, field))
    }

    /// Taxels that are not used at present, by id, and why: those that drift compensation has found unfit.
    pub fn unfit(&self) -> impl Iterator<Item = (u32, Unfit)> + '_ {
        let judged = self.drift.iter().flat_map(|kept| kept.compensation.taxels());
        judged.zip(&self.plan.body_taxels).filter_map(|((_, unfit), &taxel)| Some((self.ids[taxel], unfit?)))
    }
}
