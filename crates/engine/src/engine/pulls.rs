//! What taxels with three axes feel in a frame, found once for all the fields that share them.

use std::collections::BTreeMap;

use super::spread::Frames;
use crate::percept::Flags;
use crate::scene::Plan;
use crate::signal::{RawValue, Receptor, ShearCalibration};
use crate::stage::tangential::{Sides, Tangential};
use crate::stage::{calibrate, force};

/// What one of them feels.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pull {
    /// P.
    pub(super) pressure: f64,
    /// Along the skin, where that is known and it is pressed.
    pub(super) felt: Option<Tangential>,
    /// N for each unit of P, where that is known.
    pub(super) newtons_per_p: Option<f64>,
    /// What its fields are flagged with.
    flags: Flags,
}

/// One of them.
#[derive(Clone, Debug)]
struct PulledTaxel {
    /// Its channel in the plan.
    channel: usize,
    /// Where its tangential values are among those that the host reads.
    values: [usize; 2],
    /// How these are read.
    sides: Sides,
    newtons_per_p: Option<f64>,
    /// The plan's fields of letter shear that it is in.
    fields: Vec<usize>,
}

/// What all of them feel in one frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Pulls {
    /// By ascending channel.
    taxels: Vec<PulledTaxel>,
    /// How often the plan was calibrated when `taxels` were made.
    calibration_changes: u64,
    /// Whether the rest is of this frame.
    is_known: bool,
    /// By the plan's fields, whether a taxel of it is pressed or flagged.
    is_pressed_or_flagged: Vec<bool>,
    /// By the plan's channels, if there are `taxels`.
    felt: Vec<Pull>,
}

impl Pulls {
    pub(super) fn new(plan: &Plan) -> Self {
        let mut pulls = Self::default();
        pulls.calibrate(plan);
        if !pulls.taxels.is_empty() {
            pulls.felt = vec![Pull::default(); plan.channels()];
            pulls.is_pressed_or_flagged = vec![false; plan.fields.len()];
        }
        pulls
    }

    fn calibrate(&mut self, plan: &Plan) {
        self.calibration_changes = plan.calibration_changes;
        let Some(by) = &plan.senses.shear else { return };
        let mut by_channel = BTreeMap::new();
        for (number, field) in plan.fields.iter().enumerate() {
            if plan.letters()[field.letter].receptor != Receptor::Shear {
                continue;
            }
            for member in field.sensed.iter() {
                let Some(channel) = member.channel else { continue };
                let calibration = &plan.calibrations[channel];
                let taxel = by_channel.entry(channel).or_insert_with(|| PulledTaxel {
                    channel,
                    values: member.values,
                    sides: Sides::of(by, member.taxel, (calibration, plan.onset(channel).threshold)),
                    newtons_per_p: force::newtons_per_p(calibration.quantity, plan.areas[channel]),
                    fields: Vec::new(),
                });
                taxel.fields.push(number);
            }
        }
        self.taxels = by_channel.into_values().collect();
    }

    /// Forgets the frame.
    pub(super) fn forget(&mut self) {
        self.is_known = false;
    }

    /// Looks at the first of `frames`, if that is not done yet. `row` has the frame's values that the host reads.
    pub(super) fn look(&mut self, by: &ShearCalibration, frames: &Frames<'_>, row: &[RawValue]) {
        if std::mem::replace(&mut self.is_known, true) {
            return;
        }
        let plan = frames.plan;
        if self.calibration_changes != plan.calibration_changes {
            self.calibrate(plan);
        }
        self.is_pressed_or_flagged.fill(false);
        for own in &self.taxels {
            let raw = frames.raw.rows.value(frames.offset, own.channel);
            let calibration = &plan.calibrations[own.channel];
            let (pressure, mut flags) = calibrate::pressure_and_flags(raw, calibration, plan.curve_of(own.channel));
            let mut felt = None;
            if pressure > 0.0 {
                match own.sides.read(by, pressure, own.values.map(|value| row[value])) {
                    Ok(tangential) => felt = Some(tangential),
                    Err(why) => flags |= why.into(),
                }
            }
            if pressure > 0.0 || !flags.is_empty() {
                own.fields.iter().for_each(|&field| self.is_pressed_or_flagged[field] = true);
            }
            self.felt[own.channel] = Pull { pressure, felt, newtons_per_p: own.newtons_per_p, flags };
        }
    }

    /// Whether any of them in the plan's field `field` is pressed or flagged.
    pub(super) fn is_pressed_or_flagged(&self, field: usize) -> bool {
        self.is_pressed_or_flagged.get(field).is_some_and(|is_pressed_or_flagged| *is_pressed_or_flagged)
    }

    /// What the taxel of `channel` feels, if it is pressed.
    pub(super) fn of_channel(&self, channel: usize) -> Option<&Pull> {
        Some(&self.felt[channel]).filter(|pull| pull.pressure > 0.0)
    }

    /// How the tangential values of the taxel of `channel` are read.
    pub(super) fn sides_of(&self, channel: usize) -> Option<&Sides> {
        let place = self.taxels.binary_search_by_key(&channel, |own| own.channel).ok()?;
        Some(&self.taxels[place].sides)
    }

    /// What the field of the taxels at `channels` is flagged with.
    pub(super) fn flags_of(&self, channels: impl Iterator<Item = usize>) -> Flags {
        channels.map(|channel| self.felt[channel].flags).collect()
    }
}
