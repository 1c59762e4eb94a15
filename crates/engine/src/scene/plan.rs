//! The plan: the least work that gives a scene what it asks for, as plain data that a backend runs.

mod lookups;

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::DVec3;

use super::curves::Curves;
use super::left_out::{LeftOut, is_pressure, pressed_members};
use super::members::{LinkPart, parts, quantity_of, surface, thresholds, unit_of, weights};
use super::onset::{SoftOnset, softened};
use super::stages::Stages;
use super::{Coordinates, Knobs, Scene, choose_fields};
use crate::body::{Body, Nearest};
use crate::error::{Error, Result, nearest};
use crate::field::{Chart, FieldSet, NoChart, WORLD};
use crate::percept::{Outputs, TouchOutputs};
use crate::signal::{Calibration, Letter, Mark, Quantity, Receptor, Response, TaxelCalibration};
use crate::stage::hysteresis::Thresholds;
use crate::stage::position::Surface;
use crate::stage::{filter, layout};

/// What a backend runs: only the taxels, fields and stages that the scene needs.
#[derive(Clone, Debug)]
pub struct Plan {
    pub(crate) outputs: Outputs,
    stages: Stages,
    /// What percepts have columns for: the outputs, and what stages work on.
    pub(crate) columns: Outputs,
    pub(super) letters: Vec<Letter>,
    knobs: Knobs,
    /// The link that stands for the world.
    relative_to: Option<String>,
    /// Up to where changes count as 0, in P per second, as the calibration has it.
    pub(crate) change_dead_band: f64,
    /// The body's taxels that are read, by ascending id; a *channel* is an index into this.
    #[doc(hidden)]
    pub body_taxels: Vec<usize>,
    /// Per channel.
    #[doc(hidden)]
    pub calibrations: Vec<TaxelCalibration>,
    /// Per channel, what soft onsets have moved in these; empty where all are hard.
    pub(crate) onsets: Vec<SoftOnset>,
    /// Counts the changes of the calibrations.
    #[doc(hidden)]
    pub calibration_changes: u64,
    /// Per channel, m².
    pub(crate) areas: Vec<f64>,
    /// How many slots are calibrated from raw values: all channels in each signal, signal by signal. The slots after them
    /// are changes of these: all channels in each letter that is one.
    pub(super) calibrated: usize,
    /// Per slot, as the f32 backends read them.
    pub(crate) taxels: Vec<layout::Taxel>,
    /// What their responses refer to.
    pub(crate) curves: Curves,
    /// Per slot, the P up to which its taxel reads 0, where contacts are fitted.
    pub(crate) feels_from: Vec<f64>,
    /// The slot of the first channel in the letter that touches of the whole body are found in, where they are wanted: its
    /// channels are all of the body's pressure taxels.
    pub(crate) touched_from: Option<usize>,
    touch_outputs: Option<TouchOutputs>,
    /// The slots that fields on several links read, ascending, where positions in the world are wanted.
    pub(crate) spread_slots: Vec<u32>,
    /// By field, the largest weight of a member.
    pub(crate) heaviest: Vec<f32>,
    /// Taxels of its fields that measure something else than pressure.
    pub(crate) left_out: LeftOut,
    /// Shared by the engine and its backend: of a large skin these are most of what a plan takes.
    #[doc(hidden)]
    pub fields: Arc<[PlanField]>,
    /// All fields' members, one field after the other, each by ascending id.
    pub(crate) members: Arc<[layout::Member]>,
}

/// A field in one letter, as a backend sees it.
#[derive(Clone, Debug)]
pub struct PlanField {
    /// Its full name.
    pub name: String,
    /// Which of the scene's letters its taxels are read in.
    pub letter: usize,
    /// Name of the anchor, or [`WORLD`].
    pub link: String,
    /// The anchor's index in the body.
    pub anchor: Option<usize>,
    pub(crate) first: usize,
    /// The number of its members.
    pub count: usize,
    pub(crate) charted: bool,
    /// Whether another field of the plan has it as its parent.
    pub(crate) divided: bool,
    pub(crate) area_known: bool,
    /// What its taxels' P is.
    pub(crate) quantity: Quantity,
    /// Whether every member's weight is 1.
    pub unweighted: bool,
    /// The power of two, at least the field's radius, that coordinates are counted in, m.
    pub unit_m: f32,
    /// When it counts as touched.
    pub(crate) thresholds: Thresholds,
    /// The distance in the unit up to which its centroid counts as still.
    pub(crate) still: layout::Still,
    pub(crate) filter: filter::Settings,
    /// About how far members lie apart, in the unit.
    pub spacing: f64,
    /// Members' weights as the layout has them; empty where single precision holds each.
    pub(crate) weights: Vec<f64>,
    /// Members' places in the unit, in double precision.
    pub places: Vec<DVec3>,
    /// Members' third coordinate in the unit.
    pub(crate) depths: Vec<f32>,
    /// Members by their links, in the body's order, where they lie on several and positions in the world are wanted; else none.
    pub(crate) parts: Arc<[LinkPart]>,
    /// Where its coordinates begin, in the anchor, m.
    pub origin_in_anchor: DVec3,
    /// Its chart, if it has one.
    pub chart: Option<Chart>,
    /// Why there is none.
    pub no_chart: Option<NoChart>,
    /// The surface over the chart, where positions are wanted.
    pub surface: Option<Surface>,
}

impl PlanField {
    /// Whether it has so many members that the CPU takes sixteen of them abreast.
    pub(crate) fn is_wide(&self) -> bool {
        self.count >= layout::MANY
    }
}

impl Plan {
    /// The plan for `scene` on `body`, whose fields are `fields`, with one robot's `calibration`.
    ///
    /// # Errors
    /// The body has no taxels or no fields; a glob is malformed or matches nothing; the calibration is for another body
    /// or has a curve that cannot be computed with; a field mixes quantities; the scene asks for a signal that no sensor has, for no letter, for one
    /// twice, or for a filter of motion that lets nothing pass.
    pub fn new(body: &Body, fields: &FieldSet, scene: &Scene, calibration: &Calibration) -> Result<Self> {
        if body.taxels.is_empty() {
            let what = "the body has no taxels: add some, as with `somatic author --taxels 500`";
            return Err(Error::failed(what).at(&body.name));
        }
        if fields.fields.is_empty() {
            return Err(Error::failed("the body has no fields: add some with `somatic author`").at(&body.name));
        }
        calibration.check_body(&body.name)?;
        let is_fsr = |taxel: &TaxelCalibration| matches!(taxel.response, Response::Fsr(_));
        Letter::check(&scene.letters)?;
        let has_changes = scene.letters.iter().any(|letter| letter.receptor == Receptor::Change);
        scene.knobs.check(scene.outputs, has_changes, scene.touches.is_some())?;
        scene.check_world()?;
        let signal = scene.letters.iter().find_map(|letter| letter.signal);
        if let Some(signal) = signal.filter(|_| !calibration.taxels.iter().any(is_fsr)) {
            return Err(Error::usage(format!(
                "signal `{signal}` is for sensors of kind `fsr`, and the calibration has none; give it `sensor = \"fsr\"` under [all] or [taxel.ID]"
            )));
        }
        if let Some(name) = calibration.fields.keys().find(|name| !fields.fields.iter().any(|f| f.name == **name)) {
            let near = nearest(name, fields.fields.iter().map(|field| field.name.as_str()));
            let hint =
                near.map_or("`somatic inspect` lists the fields".into(), |near| format!("did you mean `{near}`?"));
            return Err(Error::failed(format!(
                "the calibration has thresholds for field `{name}`, which the body does not have: {hint}"
            ))
            .at(&body.name));
        }
        let chosen = choose_fields(fields, &scene.fields).map_err(|e| e.at(&body.name))?;
        let left_out = LeftOut::of(body, &chosen, fields);
        let chosen = left_out.feeling(body, chosen, fields)?;
        let touches = scene.asked_touches();
        let read: BTreeSet<usize> = chosen
            .iter()
            .flat_map(|&f| fields.fields[f].members.iter().map(|member| member.taxel))
            .chain((0..body.taxels.len()).filter(|_| touches.is_some()))
            .filter(|&taxel| is_pressure(body, taxel))
            .collect();
        let body_taxels: Vec<usize> = read.into_iter().collect();
        let channel_of = |taxel: usize| body_taxels.binary_search(&taxel).expect("its field was chosen") as u32;
        let outputs = scene.knobs.orientation_by.applied(scene.outputs);
        let (calibrations, onsets) = softened(body_taxels.iter().map(|&taxel| calibration.taxels[taxel]));
        let mut plan = Self {
            outputs,
            stages: Stages::of(outputs),
            columns: outputs,
            letters: scene.letters.clone(),
            knobs: scene.knobs,
            relative_to: scene.checked_link(body)?,
            change_dead_band: calibration.change.dead_band,
            calibrations,
            onsets,
            calibration_changes: 0,
            areas: body_taxels.iter().map(|&taxel| body.taxels[taxel].area).collect(),
            calibrated: 0,
            taxels: Vec::new(),
            curves: Curves::default(),
            feels_from: Vec::new(),
            touched_from: None,
            touch_outputs: touches.map(|touches| touches.outputs),
            spread_slots: Vec::new(),
            heaviest: Vec::new(),
            left_out,
            fields: Arc::default(),
            members: Arc::default(),
            body_taxels: Vec::new(),
        };
        let first_slots = plan.lay_out_slots(calibration)?;
        if touches.is_some() {
            plan.find_touches(&first_slots)?;
        }
        plan.note_what_is_felt();
        let nearest = Nearest::new(body);
        let parents: BTreeSet<usize> = chosen.iter().filter_map(|&index| fields.fields[index].parent).collect();
        let (mut plan_fields, mut members) =
            (Vec::<PlanField>::with_capacity(chosen.len()), Vec::<layout::Member>::new());
        for (index, field) in chosen.into_iter().map(|index| (index, pressed_members(body, &fields.fields[index]))) {
            let field = &*field;
            let (count, unit_m) = (field.members.len(), unit_of(field.radius_m()));
            let places: Vec<DVec3> = field.members.iter().map(|member| member.place / f64::from(unit_m)).collect();
            let first = plan_fields.len();
            let still = layout::Still::new(plan.sums(count), count, field.radius_m() / f64::from(unit_m));
            plan_fields.push(PlanField {
                name: field.name.clone(),
                letter: 0,
                link: field.anchor.map_or(WORLD, |anchor| &body.links[anchor].name).to_owned(),
                anchor: field.anchor,
                first: members.len(),
                count,
                charted: field.chart.is_ok(),
                divided: parents.contains(&index),
                quantity: quantity_of(body, field, calibration)?,
                area_known: field.members.iter().all(|member| body.taxels[member.taxel].area > 0.0),
                weights: weights(field),
                unweighted: field.members.iter().all(|member| member.weight as f32 == 1.0),
                unit_m,
                thresholds: Thresholds::default(),
                still,
                filter: scene.filter.settings(field.spacing_m(), still, f64::from(unit_m))?,
                parts: if plan.stages().position && scene.coordinates == Coordinates::World {
                    parts(body, field)
                } else {
                    Arc::default()
                },
                depths: places.iter().map(|place| place.z as f32).collect(),
                origin_in_anchor: field.origin_in_anchor,
                chart: field.chart.as_ref().ok().cloned(),
                no_chart: field.chart.as_ref().err().cloned(),
                surface: plan.stages().position.then(|| surface(&nearest, field)).flatten(),
                spacing: field.spacing_m() / f64::from(unit_m),
                places,
            });
            // The same in every letter, but for what it reads and when it counts as touched.
            for letter in 1..plan.letters.len() {
                plan_fields.push(PlanField { letter, ..plan_fields[first].clone() });
            }
            for (letter, &first_slot) in first_slots.iter().enumerate() {
                let in_letter = &mut plan_fields[first + letter];
                in_letter.first = members.len();
                in_letter.thresholds = thresholds(calibration, &field.name, plan.letters[letter].receptor);
                members.extend(field.members.iter().zip(&in_letter.places).map(|(member, place)| layout::Member {
                    slot: first_slot + channel_of(member.taxel),
                    weight: member.weight as f32,
                    u: place.x as f32,
                    v: place.y as f32,
                }));
            }
        }
        let weights = |field: &PlanField| members[field.first..][..field.count].iter().map(|member| member.weight);
        plan.heaviest = plan_fields.iter().map(|field| weights(field).fold(0.0, f32::max)).collect();
        let spread = plan_fields.iter().filter(|field| !field.parts.is_empty());
        let slots = spread.flat_map(|field| members[field.first..][..field.count].iter().map(|member| member.slot));
        plan.spread_slots = slots.collect::<BTreeSet<u32>>().into_iter().collect();
        plan.body_taxels = body_taxels;
        plan.fields = plan_fields.into();
        plan.members = members.into();
        plan.stages.hysteresis = plan.fields.iter().any(|field| field.thresholds != Thresholds::default());
        if plan.stages.hysteresis {
            plan.columns |= Outputs::TOTAL;
        }
        if plan.stages().position || plan.stages().filter {
            plan.columns |= Outputs::CENTROID;
        }
        plan.columns |= plan.read_back();
        if plan.stages().motion || plan.stages().filter {
            plan.columns |= Outputs::ACTIVE;
        }
        Ok(plan)
    }

    /// What places in the world are said to be in: `world`, or the link of [`Scene::relative_to`].
    #[must_use]
    pub fn world(&self) -> &str {
        self.relative_to().unwrap_or(WORLD)
    }

    /// The link in whose frame places are given instead of the world.
    #[must_use]
    pub fn relative_to(&self) -> Option<&str> {
        self.relative_to.as_deref()
    }

    /// The quantities that are computed.
    #[must_use]
    pub fn outputs(&self) -> Outputs {
        self.outputs
    }

    /// What the soft onset of the taxel at `channel` has moved, if it has one.
    pub(crate) fn onset(&self, channel: usize) -> SoftOnset {
        self.onsets.get(channel).copied().unwrap_or_default()
    }

    /// Calibrates the taxel at `channel` from now on with `baseline`, its raw value at rest, and leaves it out if it is `unfit`; `made` is how all
    /// slots were before any drift compensation.
    pub(crate) fn keep_up(&mut self, channel: usize, baseline: f32, unfit: bool, made: &[layout::Taxel]) {
        let shift = self.onset(channel).shift;
        let baseline = if shift == 0.0 { baseline } else { (f64::from(baseline) + shift) as f32 };
        for slot in (channel..self.calibrated).step_by(self.channels()) {
            let response = if unfit { layout::MASKED } else { made[slot].response };
            self.calibration_changes += 1;
            self.taxels[slot] = layout::Taxel { baseline, response, ..made[slot] };
            self.calibrations[channel].mask = response == layout::MASKED;
        }
        // One that has not moved stays as it is written.
        let kept = &mut self.calibrations[channel].baseline;
        if *kept as f32 != baseline {
            *kept = baseline.into();
        }
    }

    /// Per channel, whether one of its own fields is in lasting contact, where `touched` says it of each field. A taxel's
    /// own fields are those that no child divides further, so that a body that is touched somewhere is not touched
    /// everywhere.
    pub(crate) fn touched_channels(&self, touched: &[bool]) -> Vec<bool> {
        let mut own = vec![false; self.channels()];
        let mut finest = vec![false; self.channels()];
        let lasting = |field: &PlanField| self.letters[field.letter].receptor == Receptor::Sustained;
        let fields: Vec<_> = self.fields.iter().zip(touched).filter(|(field, _)| lasting(field)).collect();
        for divided in [false, true] {
            for &(field, &touched) in fields.iter().filter(|(field, _)| field.divided == divided) {
                for member in self.members_of(field) {
                    let channel = self.channel_of(member.slot as usize);
                    if !divided || !finest[channel] {
                        own[channel] |= touched;
                    }
                    finest[channel] |= !divided;
                }
            }
        }
        own
    }

    /// Takes over the taxels' calibration of `other`, which is the same plan but for that.
    pub(crate) fn recalibrate(&mut self, other: &Self) {
        self.calibrations.clone_from(&other.calibrations);
        self.taxels.clone_from(&other.taxels);
    }

    /// Number of taxels that are read.
    #[must_use]
    pub fn channels(&self) -> usize {
        self.body_taxels.len()
    }

    /// Number of values that fields are made of in a frame: a taxel has one for each signal and letter that needs it.
    #[must_use]
    pub fn slots(&self) -> usize {
        self.taxels.len()
    }

    /// How many of the slots, the first ones, are pressures calibrated from raw values; the others are their changes.
    pub(crate) fn calibrated(&self) -> usize {
        self.calibrated
    }

    /// Whether changes of values say where a field on several links is touched.
    pub(crate) fn has_spread_changes(&self) -> bool {
        self.spread_slots.last().is_some_and(|&slot| slot as usize >= self.calibrated())
    }

    pub(crate) fn has_changes(&self) -> bool {
        self.calibrated < self.slots()
    }

    #[doc(hidden)]
    pub fn channel_of(&self, slot: usize) -> usize {
        slot % self.channels()
    }

    /// The letters that every field is read in; what [`Percept::letter`](crate::percept::Percept::letter) counts.
    #[must_use]
    pub fn letters(&self) -> &[Letter] {
        &self.letters
    }

    /// Number of (field, taxel) pairs: the work of a frame.
    #[must_use]
    pub fn memberships(&self) -> usize {
        self.members.len()
    }

    /// Names of the fields, in the order of the percepts, each with the link it answers in. A field stands there once for
    /// each of [`Plan::letters`], in their order.
    pub fn fields(&self) -> impl ExactSizeIterator<Item = (&str, &str)> {
        self.fields.iter().map(|field| (field.name.as_str(), field.link.as_str()))
    }

    /// What is to be said of the letter of field `field` of the percepts, beside the field's name.
    #[must_use]
    pub fn mark(&self, field: usize) -> Mark {
        let letter = self.fields.get(field).map(|field| self.letters[field.letter]);
        letter.map_or(Mark::default(), |letter| letter.mark(&self.letters))
    }

    /// What P is in field `field` of the percepts; of letter `change` P stands for its change per second.
    #[must_use]
    pub fn quantity(&self, field: usize) -> Quantity {
        self.fields.get(field).map_or(Quantity::Count, |field| field.quantity)
    }

    /// What P is in all fields, if it is the same in all.
    #[must_use]
    pub fn common_quantity(&self) -> Option<Quantity> {
        let first = self.quantity(0);
        self.fields.iter().all(|field| field.quantity == first).then_some(first)
    }

    /// What people call field `field` of the percepts: its name, and what is to be said of its letter.
    #[must_use]
    pub fn label(&self, field: usize) -> String {
        self.fields.get(field).map_or(String::new(), |named| format!("{}{}", named.name, self.mark(field)))
    }
}
