//! What backends look up in a plan: by slot, by field, by knob.

use std::collections::BTreeMap;

use super::super::stages::Stages;
use super::super::{Arithmetic, Knobs};
use super::{Plan, PlanField};
use crate::error::{Error, Result};
use crate::percept::{Outputs, TouchOutputs};
use crate::signal::Receptor;
use crate::stage::calibrate::Table;
use crate::stage::{Sums, force, layout};

impl Plan {
    /// The taxels of its fields, as indices of the body, and how many values each has: three where its shear is asked for.
    #[doc(hidden)]
    #[must_use]
    pub fn taxels_of_fields(&self) -> BTreeMap<usize, usize> {
        let members = self.fields.iter().flat_map(|field| self.members_of(field));
        let pressed = members.map(|member| (self.body_taxels[self.channel_of(member.slot as usize)], 1));
        let mut taxels: BTreeMap<usize, usize> = pressed.collect();
        for field in self.fields.iter() {
            let values = if self.letters[field.letter].receptor == Receptor::Shear { 3 } else { 1 };
            for member in field.sensed.iter() {
                let own = taxels.entry(member.taxel).or_default();
                *own = values.max(*own);
            }
        }
        taxels
    }

    /// Per slot that is calibrated.
    #[doc(hidden)]
    #[inline]
    pub fn curve_of(&self, slot: usize) -> Table<'_> {
        self.curves.table(self.taxels[slot].response)
    }

    #[doc(hidden)]
    pub fn members_of(&self, field: &PlanField) -> &[layout::Member] {
        &self.members[field.first..field.first + field.count]
    }

    /// How many newtons are one unit of P of `channel`, by its unit and its taxel's area; `None` if one of these is not known.
    #[doc(hidden)]
    #[must_use]
    pub fn newtons_per_p(&self, channel: usize) -> Option<f64> {
        force::newtons_per_p(self.calibrations[channel].quantity, self.areas[channel])
    }

    /// The weight of member `member` of `field`, as the layout has it.
    #[doc(hidden)]
    pub fn weight(&self, field: &PlanField, member: usize) -> f64 {
        field.weights.get(member).copied().unwrap_or_else(|| self.members[field.first + member].weight.into())
    }

    /// By the taxel's place in the body, the raw tangential values at rest of those that have their own, where any are read: what a tare
    /// changes of them.
    #[doc(hidden)]
    #[must_use]
    pub fn tangential_baselines(&self) -> Option<&BTreeMap<usize, [f64; 2]>> {
        self.senses.shear.as_ref().map(|shear| &shear.own_baselines)
    }

    /// Takes these over, where any are read.
    #[doc(hidden)]
    pub fn set_tangential_baselines(&mut self, baselines: &BTreeMap<usize, [f64; 2]>) {
        self.senses.shear.iter_mut().for_each(|shear| shear.own_baselines.clone_from(baselines));
    }

    /// How many taxels' pressures percepts keep.
    pub(crate) fn kept_pressures(&self) -> usize {
        if self.stages().pressures { self.slots() } else { 0 }
    }

    /// Whether any of its fields is read as pressures.
    pub(in super::super) fn presses(&self) -> bool {
        self.fields.iter().any(|field| field.sensed.is_empty())
    }

    /// What is given of touches of the whole body; `None` where none are looked for.
    #[must_use]
    pub fn touch_outputs(&self) -> Option<TouchOutputs> {
        self.touch_outputs
    }

    /// Whether a letter or touches give what `receptor` reads, beside wrenches.
    pub(in super::super) fn gives(&self, receptor: Receptor) -> bool {
        let of_touches = match receptor {
            Receptor::Shear => TouchOutputs::SHEAR,
            Receptor::Temperature => TouchOutputs::TEMPERATURE,
            Receptor::Sustained | Receptor::Change | Receptor::Proximity => TouchOutputs::empty(),
        };
        self.letters.iter().any(|letter| letter.receptor == receptor)
            || self.touch_outputs.is_some_and(|outputs| outputs.intersects(of_touches))
    }

    /// Keeps the pressures that touches of the whole body are found in: those of the first letter `sustained`.
    pub(super) fn find_touches(&mut self, first_slots: &[u32]) -> Result<()> {
        let mut letters = self.letters.iter().zip(first_slots);
        let Some((_, &first)) = letters.find(|(letter, _)| letter.receptor == Receptor::Sustained) else {
            return Err(Error::usage(
                "touches are found in pressures: ask for letter `sustained` too, or for no touches",
            ));
        };
        self.touched_from = Some(first as usize);
        self.stages.pressures = true;
        Ok(())
    }

    /// What a device gives back: the outputs, and what shows the host the touches that one taxel dominates.
    pub(crate) fn read_back(&self) -> Outputs {
        let of_orientation = Outputs::TOTAL | Outputs::PEAK | Outputs::ACTIVE;
        if self.outputs.contains(Outputs::ORIENTATION) { self.outputs | of_orientation } else { self.outputs }
    }

    /// What is traded for what.
    #[must_use]
    pub fn knobs(&self) -> Knobs {
        self.knobs
    }

    /// How single precision adds up over a field of `members`, and so how far it may be off.
    pub(crate) fn sums(&self, members: usize) -> Sums {
        if self.is_compensated() { Sums::compensated(members) } else { Sums::OnePass }
    }

    pub(crate) fn is_compensated(&self) -> bool {
        self.knobs.arithmetic == Some(Arithmetic::Compensated)
    }

    pub(crate) fn stages(&self) -> Stages {
        self.stages
    }
}
