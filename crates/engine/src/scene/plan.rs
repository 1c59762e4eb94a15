//! The plan: the least work that gives a scene what it asks for, as plain data that a backend runs.

mod lookups;
mod make;

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::Knobs;
use super::curves::Curves;
use super::left_out::LeftOut;
use super::members::LinkPart;
use super::onset::SoftOnset;
use super::senses::{SensedMember, Senses};
use super::stages::Stages;
use crate::field::{Chart, NoChart, WORLD};
use crate::percept::{Outputs, TouchOutputs};
use crate::signal::{Letter, Mark, Quantity, Receptor, TaxelCalibration};
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
    /// What the host reads for letters that are not made of pressures.
    pub(crate) senses: Senses,
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
    /// Taxels of its fields that no letter reads.
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
    /// Its members in a letter that the host makes; then backends have none.
    pub(crate) sensed: Arc<[SensedMember]>,
    /// The surface over the chart, where positions are wanted.
    pub surface: Option<Surface>,
}

impl PlanField {
    /// The same with the members `sensed` alone, which the host reads: backends have none from `first` on.
    pub(super) fn of_senses(
        self,
        letter: usize,
        first: usize,
        receptor: Receptor,
        sensed: Arc<[SensedMember]>,
    ) -> Self {
        // Of the forces of a taxel, those along its tangents are in the unit of the one along its normal.
        let quantity = if receptor == Receptor::Shear { self.quantity } else { Quantity::Count };
        Self {
            letter,
            first,
            count: 0,
            thresholds: Thresholds::default(),
            quantity,
            weights: Vec::new(),
            places: Vec::new(),
            depths: Vec::new(),
            parts: Arc::default(),
            sensed,
            ..self
        }
    }

    /// The number of taxels that its percepts are made of.
    #[must_use]
    pub fn taxels(&self) -> usize {
        self.count + self.sensed.len()
    }

    /// Of a letter that the host makes, its taxels' (u, v) in the field's chart, m.
    pub fn sensed_places_m(&self) -> impl Iterator<Item = DVec2> + '_ {
        self.sensed.iter().map(|member| member.place_m)
    }

    /// Whether it has enough members for the CPU to take sixteen of them side by side.
    pub(crate) fn is_wide(&self) -> bool {
        self.count >= layout::MANY
    }
}

/// A field that percepts come of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct PlannedField<'a> {
    /// Its name in the body.
    pub name: &'a str,
    /// The link in whose frame its percepts are, unless the scene asks for the world's.
    pub link: &'a str,
}

impl Plan {
    /// The frame of places in the world: `world`, or the link of [`Scene::relative_to`](super::Scene::relative_to).
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

    /// Calibrates the taxel at `channel` from now on with `baseline`, its raw value at rest, and leaves it out if it is `unfit`; `made` is
    /// how all slots were before any drift compensation.
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

    /// The letters that fields are read in; what [`Percept::letter`](crate::percept::Percept::letter) counts.
    #[must_use]
    pub fn letters(&self) -> &[Letter] {
        &self.letters
    }

    /// Which of the letters field `field` is of.
    ///
    /// # Panics
    /// There is no such field.
    #[must_use]
    pub fn letter_of(&self, field: usize) -> usize {
        self.fields[field].letter
    }

    /// By field, which of the letters it is of; empty where all are of one.
    pub(crate) fn letter_by_field(&self) -> Arc<[u8]> {
        if self.letters.len() < 2 {
            Arc::default()
        } else {
            self.fields.iter().map(|field| field.letter as u8).collect()
        }
    }

    /// Number of (field, taxel) pairs: the work of a frame.
    #[must_use]
    pub fn memberships(&self) -> usize {
        self.members.len()
    }

    /// The fields, in the order of the percepts. A field is in the list once for each of [`Plan::letters`] that its
    /// taxels have, in their order.
    pub fn fields(&self) -> impl ExactSizeIterator<Item = PlannedField<'_>> {
        self.fields.iter().map(|field| PlannedField { name: &field.name, link: &field.link })
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

    /// What P is in all fields, if it is the same in all; temperatures and distances, which are not P, do not count.
    #[must_use]
    pub fn common_quantity(&self) -> Option<Quantity> {
        let has_p = |field: &&PlanField| {
            !matches!(self.letters[field.letter].receptor, Receptor::Temperature | Receptor::Proximity)
        };
        let of_fields = self.fields.iter().filter(has_p).map(|field| field.quantity);
        // Touches have P also where no field has.
        let of_touches = self.touched_from.is_some() && !self.fields.iter().any(|field| has_p(&field));
        let touched = self.calibrations.iter().filter(|_| of_touches).map(|taxel| taxel.quantity);
        let mut quantities = of_fields.chain(touched);
        let first = quantities.next().unwrap_or_default();
        quantities.all(|other| other == first).then_some(first)
    }

    /// What people call field `field` of the percepts: its name, and what is to be said of its letter.
    #[must_use]
    pub fn label(&self, field: usize) -> String {
        self.fields.get(field).map_or(String::new(), |named| format!("{}{}", named.name, self.mark(field)))
    }
}
