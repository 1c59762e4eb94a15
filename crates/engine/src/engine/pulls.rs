//! What taxels with three axes feel in a frame, found once for all the fields that share them.

use std::collections::BTreeMap;

use super::spread::Frames;
use crate::percept::Flags;
use crate::scene::Plan;
use crate::signal::{RawValue, Receptor, ShearCalibration, TaxelCalibration};
use crate::stage::{calibrate, force};

/// What one of them feels.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pull {
    /// P.
    pub(super) pressure: f64,
    /// Along t and n × t, where that is known and it is pressed.
    pub(super) shear: Option<[f64; 2]>,
    /// N for each unit of P, where that is known.
    pub(super) newtons_per_p: Option<f64>,
    /// What its fields are flagged with.
    flags: Flags,
}

/// One of them.
#[derive(Clone, Copy, Debug)]
struct PulledTaxel {
    /// Its channel in the plan.
    channel: usize,
    /// Where its tangential values are among those that the host reads.
    values: [usize; 2],
    /// P for a raw unit of these.
    gain: f64,
    /// Their raw values at rest.
    rest: [f64; 2],
    newtons_per_p: Option<f64>,
}

/// What all of them feel in one frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Pulls {
    taxels: Vec<PulledTaxel>,
    /// How often the plan was calibrated when `taxels` were made.
    calibration_changes: u64,
    /// Whether the rest is of this frame.
    is_known: bool,
    is_pressed: bool,
    has_flags: bool,
    /// By the plan's channels, if there are `taxels`.
    felt: Vec<Pull>,
}

impl Pulls {
    pub(super) fn new(plan: &Plan) -> Self {
        let mut pulls = Self::default();
        pulls.calibrate(plan);
        if !pulls.taxels.is_empty() {
            pulls.felt = vec![Pull::default(); plan.channels()];
        }
        pulls
    }

    fn calibrate(&mut self, plan: &Plan) {
        self.calibration_changes = plan.calibration_changes;
        let Some(by) = &plan.senses.shear else { return };
        let fields = plan.fields.iter();
        let of_shear = fields.filter(|field| plan.letters()[field.letter].receptor == Receptor::Shear);
        let members = of_shear.flat_map(|field| field.sensed.iter());
        let by_channel: BTreeMap<usize, (usize, [usize; 2])> =
            members.filter_map(|member| Some((member.channel?, (member.taxel, member.values)))).collect();
        let made = by_channel.into_iter().map(|(channel, (taxel, values))| {
            let calibration = &plan.calibrations[channel];
            PulledTaxel {
                channel,
                values,
                gain: tangential_gain(by, taxel, calibration),
                rest: by.rest_of(taxel),
                newtons_per_p: force::newtons_per_p(calibration.quantity, plan.areas[channel]),
            }
        });
        self.taxels = made.collect();
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
        (self.is_pressed, self.has_flags) = (false, false);
        for own in &self.taxels {
            let raw = frames.raw.rows.value(frames.offset, own.channel);
            let calibration = &plan.calibrations[own.channel];
            let (pressure, mut flags) = calibrate::pressure_and_flags(raw, calibration, plan.curve_of(own.channel));
            let mut felt = Pull { pressure, newtons_per_p: own.newtons_per_p, ..Pull::default() };
            if pressure > 0.0 {
                self.is_pressed = true;
                match tangential(by, (own.rest, own.gain), pressure, own.values.map(|value| row[value])) {
                    Ok(shear) => felt.shear = Some(shear),
                    Err(why) => flags |= why,
                }
            }
            felt.flags = flags;
            self.has_flags |= !flags.is_empty();
            self.felt[own.channel] = felt;
        }
    }

    /// Whether any of them is pressed.
    pub(super) fn is_pressed(&self) -> bool {
        self.is_pressed
    }

    /// What the taxel of `channel` feels, if it is pressed.
    pub(super) fn of_channel(&self, channel: usize) -> Option<&Pull> {
        Some(&self.felt[channel]).filter(|pull| pull.pressure > 0.0)
    }

    /// What the field of the taxels at `channels` is flagged with.
    pub(super) fn flags_of(&self, channels: impl Iterator<Item = usize>) -> Flags {
        if self.has_flags { channels.map(|channel| self.felt[channel].flags).collect() } else { Flags::empty() }
    }
}

/// P for a raw unit of a tangential value of the body's taxel `taxel`.
pub(super) fn tangential_gain(by: &ShearCalibration, taxel: usize, calibration: &TaxelCalibration) -> f64 {
    by.gain_of(taxel, calibration.gain, calibration.unit_factor)
}

/// The numbers of two tangential raw values, or why there are none.
fn numbers_of(raw: [RawValue; 2]) -> Result<[f64; 2], Flags> {
    match raw.map(|raw| raw.number().filter(|number| number.abs() <= calibrate::HUGE)) {
        [Some(u), Some(v)] => Ok([u, v]),
        _ if raw.iter().any(|raw| raw.is_missing()) => Err(Flags::INCOMPLETE),
        _ => Err(Flags::FAULTY_INPUT),
    }
}

/// The tangential forces along t and n × t of a taxel with this `rest` and `gain`, where it is pressed by `pressure` and reads `raw`; or why
/// they are not known. What is beyond 2⁶⁰ is not believed, as of P.
pub(super) fn tangential(
    by: &ShearCalibration,
    (rest, gain): ([f64; 2], f64),
    pressure: f64,
    raw: [RawValue; 2],
) -> Result<[f64; 2], Flags> {
    let forces = by.forces(rest, gain, pressure, numbers_of(raw)?);
    if forces.iter().all(|force| force.abs() <= calibrate::HUGE) { Ok(forces) } else { Err(Flags::FAULTY_INPUT) }
}
