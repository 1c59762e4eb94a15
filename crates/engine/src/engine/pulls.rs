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
    pub(super) shear: Option<Tangential>,
    /// N for each unit of P, where that is known.
    pub(super) newtons_per_p: Option<f64>,
    /// What its fields are flagged with.
    flags: Flags,
}

/// What a taxel feels along the skin.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tangential {
    /// Along t and n × t.
    pub(super) forces: [f64; 2],
    /// What they are made of, sizes added up.
    pub(super) size: f64,
}

/// How a taxel's tangential raw values are read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sides {
    /// P for a raw unit of each.
    pub(super) gains: [f64; 2],
    /// At rest.
    rest: [f64; 2],
    /// Of those that are believed.
    range: [f64; 2],
    /// What a soft onset has taken off P, which the sensor has measured all the same.
    taken_off: f64,
    /// How much of both forces P makes, and a raw unit of each: sizes added up.
    sizes: [f64; 3],
}

impl Sides {
    /// Those of the body's taxel `taxel`, from whose P `taken_off` is taken.
    pub(super) fn of(by: &ShearCalibration, taxel: usize, (calibration, taken_off): (&TaxelCalibration, f64)) -> Self {
        let gains = by.gains_of(taxel, calibration.gain, calibration.unit_factor);
        let [along, across] = by.cross_axis;
        let shares = [0, 1, 2].map(|of| along[of].abs() + across[of].abs());
        let sizes = [shares[0], shares[1] * gains[0].abs(), shares[2] * gains[1].abs()];
        Self { gains, rest: by.rest_of(taxel), range: by.range_of(taxel), taken_off, sizes }
    }

    /// What the forces are made of at these `raw` values.
    fn size(&self, pressure: f64, raw: [f64; 2]) -> f64 {
        let [of_p, of_u, of_v] = self.sizes;
        let [u, v] = [0, 1].map(|axis| raw[axis].abs() + self.rest[axis].abs());
        of_p * (pressure + self.taken_off) + of_u * u + of_v * v
    }
}

/// One of them.
#[derive(Clone, Copy, Debug)]
struct PulledTaxel {
    /// Its channel in the plan.
    channel: usize,
    /// Where its tangential values are among those that the host reads.
    values: [usize; 2],
    /// How these are read.
    sides: Sides,
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
                sides: Sides::of(by, taxel, (calibration, plan.onset(channel).threshold)),
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
                match tangential(by, own.sides, pressure, own.values.map(|value| row[value])) {
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

/// The numbers of two tangential raw values, or why there are none.
fn numbers_of(raw: [RawValue; 2]) -> Result<[f64; 2], Flags> {
    match raw.map(|raw| raw.number().filter(|number| number.abs() <= calibrate::HUGE)) {
        [Some(u), Some(v)] => Ok([u, v]),
        _ if raw.iter().any(|raw| raw.is_missing()) => Err(Flags::INCOMPLETE),
        _ => Err(Flags::FAULTY_INPUT),
    }
}

/// The tangential forces along t and n × t of a taxel that is pressed by `pressure` and reads `raw`; or why they are not known.
/// What is beyond 2⁶⁰ is not believed, as of P.
pub(super) fn tangential(
    by: &ShearCalibration,
    sides: Sides,
    pressure: f64,
    raw: [RawValue; 2],
) -> Result<Tangential, Flags> {
    let (numbers, [low, high]) = (numbers_of(raw)?, sides.range);
    if numbers.iter().any(|number| !(low..=high).contains(number)) {
        return Err(Flags::OUT_OF_RANGE);
    }
    let forces = by.forces(sides.rest, sides.gains, pressure + sides.taken_off, numbers);
    let is_believed = forces.iter().all(|force| force.abs() <= calibrate::HUGE);
    let felt = Tangential { forces, size: sides.size(pressure, numbers) };
    if is_believed { Ok(felt) } else { Err(Flags::FAULTY_INPUT) }
}
