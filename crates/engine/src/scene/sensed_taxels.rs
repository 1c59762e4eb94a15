//! What single taxels read in letters that are not made of pressures: to look at, on a page or in a picture.

use super::Plan;
use crate::body::Body;
use crate::signal::{Axis, RawValue, Reading, Receptor, SenseCalibration, ShearCalibration};
use crate::stage::calibrate;
use crate::stage::proximity::LEAST_M;
use crate::stage::tangential::{Sides, Tangential, Unknown};

/// The taxels of a plan that are read as temperatures, distances or tangential forces, by ascending index in the body. It reads
/// them in double precision.
#[derive(Clone, Debug, Default)]
pub struct SensedTaxels {
    taxels: Vec<SensedTaxel>,
    channels: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct SensedTaxel {
    taxel: usize,
    receptor: Receptor,
    /// Which of the channels its values are: of one with three axes, the tangential ones.
    values: [usize; 2],
}

/// What one such taxel reads.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct SensedValue {
    /// Its index in the body.
    pub taxel: usize,
    /// The letter that reads it: temperature, proximity or shear.
    pub receptor: Receptor,
    /// The raw value that it is made of; of tangential forces the one along t.
    pub raw: RawValue,
    /// °C, m, or the size of the tangential force in the unit of P; and whether it is in range: of a distance, whether something is near.
    pub reading: Reading,
    /// The tangential forces along t and n × t, in the unit of P; 0 of other letters, and where nothing presses.
    pub shear: [f64; 2],
}

/// Least and greatest temperatures, °C, and distances, m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SenseRanges {
    /// °C; `None` where none is known.
    pub celsius: Option<[f64; 2]>,
    /// m; `None` where none is known.
    pub distance_m: Option<[f64; 2]>,
}

impl SenseRanges {
    /// Takes in what a taxel reads, if it is in range.
    pub fn see(&mut self, value: &SensedValue) {
        let Reading::Value(number, true) = value.reading else { return };
        let range = match value.receptor {
            Receptor::Temperature => &mut self.celsius,
            Receptor::Proximity => &mut self.distance_m,
            _ => return,
        };
        let [low, high] = range.unwrap_or([number; 2]);
        *range = Some([low.min(number), high.max(number)]);
    }

    /// The least that hold both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        let both = |one: Option<[f64; 2]>, other: Option<[f64; 2]>| match (one, other) {
            (Some([low, high]), Some([l, h])) => Some([low.min(l), high.max(h)]),
            (one, other) => one.or(other),
        };
        Self { celsius: both(self.celsius, other.celsius), distance_m: both(self.distance_m, other.distance_m) }
    }

    /// Those that the calibration of `plan` allows, where it has ends: of temperatures by raw ranges, of distances by the range too.
    #[must_use]
    pub fn of_calibration(plan: &Plan) -> Self {
        let ends = |by: &SenseCalibration| {
            let own = std::iter::once(&by.all).chain(by.own.values());
            let ends = own.flat_map(|sense| sense.raw_range.map(|end| sense.read(RawValue::new(end))));
            let known: Option<Vec<f64>> = ends
                .map(|end| match end {
                    Reading::Value(value, _) if value.abs() <= calibrate::HUGE => Some(value),
                    _ => None,
                })
                .collect();
            let fold = |values: Vec<f64>| {
                values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &x| [low.min(x), high.max(x)])
            };
            known.map(fold)
        };
        let distance = |by: &SenseCalibration| match by.range_m {
            range_m if range_m.is_finite() => Some([0.0, range_m]),
            _ => ends(by),
        };
        Self {
            celsius: plan.senses.temperature.as_ref().and_then(ends),
            distance_m: plan.senses.proximity.as_ref().and_then(distance),
        }
    }
}

impl SensedTaxels {
    /// Those of `plan`, which is of `body`, whose letters or touches are asked for.
    #[must_use]
    pub fn new(plan: &Plan, body: &Body) -> Self {
        Self::chosen(plan, body, |receptor| plan.gives(receptor))
    }

    /// The same, and those that are read for wrenches alone.
    #[must_use]
    pub fn with_wrenches(plan: &Plan, body: &Body) -> Self {
        Self::chosen(plan, body, |_| true)
    }

    fn chosen(plan: &Plan, body: &Body, is_wanted: impl Fn(Receptor) -> bool) -> Self {
        let place = |taxel: u32, axis: Axis| plan.senses.place_of(taxel, axis);
        let of_taxel = |(index, taxel): (usize, &crate::body::Taxel)| {
            let letter = Receptor::OF_HOST
                .into_iter()
                .find(|receptor| receptor.reads(taxel.modality))
                .filter(|&receptor| is_wanted(receptor))?;
            let values = match letter {
                Receptor::Shear => [Axis::U, Axis::V].map(|axis| place(taxel.id, axis)),
                _ => [place(taxel.id, Axis::Normal); 2],
            };
            let [Some(first), Some(second)] = values else { return None };
            Some(SensedTaxel { taxel: index, receptor: letter, values: [first, second] })
        };
        Self {
            taxels: body.taxels.iter().enumerate().filter_map(of_taxel).collect(),
            channels: plan.senses.ids().to_vec(),
        }
    }

    /// The channels whose values are read, ascending.
    #[must_use]
    pub fn channels(&self) -> &[u32] {
        &self.channels
    }

    /// The taxels and the letters that read them, in their order, with which of [`SensedTaxels::channels`] their values are.
    pub fn all(&self) -> impl Iterator<Item = (usize, Receptor, [usize; 2])> + '_ {
        self.taxels.iter().map(|own| (own.taxel, own.receptor, own.values))
    }

    /// What they read under `plan`, in their order: `raw` by the plan's channels, `sensed` by [`SensedTaxels::channels`]. A taxel
    /// without a value there has none.
    pub fn read<'a>(
        &'a self,
        plan: &'a Plan,
        raw: &'a [RawValue],
        sensed: &'a [RawValue],
    ) -> impl Iterator<Item = SensedValue> + 'a {
        let value = |at: usize| sensed.get(at).copied().unwrap_or(RawValue::MISSING);
        self.taxels.iter().map(move |own| {
            let (raw_value, senses) = (value(own.values[0]), &plan.senses);
            let (reading, shear) = match own.receptor {
                Receptor::Shear => match &senses.shear {
                    Some(by) => pulled(by, plan, own.taxel, raw, own.values.map(value)),
                    None => (Reading::Missing, [0.0; 2]),
                },
                Receptor::Proximity => {
                    let by = senses.proximity.as_ref().map(|by| (by.of_taxel(own.taxel), by.range_m));
                    let reading = by.map_or(Reading::Missing, |(sense, range_m)| match sense.read(raw_value) {
                        Reading::Value(distance_m, _) => {
                            let is_near = distance_m <= range_m && !sense.end_beyond(raw_value).is_gt();
                            Reading::Value(distance_m.max(LEAST_M), is_near)
                        }
                        reading => reading,
                    });
                    (reading, [0.0; 2])
                }
                _ => {
                    let by = senses.temperature.as_ref();
                    (by.map_or(Reading::Missing, |by| by.of_taxel(own.taxel).read(raw_value)), [0.0; 2])
                }
            };
            SensedValue { taxel: own.taxel, receptor: own.receptor, raw: raw_value, reading, shear }
        })
    }
}

/// How the taxel at `taxel` is pulled: the size and the two parts of its tangential force, 0 where nothing presses.
fn pulled(
    by: &ShearCalibration,
    plan: &Plan,
    taxel: usize,
    raw: &[RawValue],
    tangential: [RawValue; 2],
) -> (Reading, [f64; 2]) {
    let channel = plan.body_taxels.binary_search(&taxel).ok();
    let Some((channel, &normal)) = channel.and_then(|channel| Some((channel, raw.get(channel)?))) else {
        return (Reading::Missing, [0.0; 2]);
    };
    let calibration = &plan.calibrations[channel];
    let felt = match calibrate::pressure(normal, calibration, plan.curve_of(channel)) {
        None if normal.is_missing() => Err(Unknown::Missing),
        None => Err(Unknown::Faulty),
        Some(pressure) if pressure > 0.0 => {
            let sides = Sides::of(by, taxel, (calibration, plan.onset(channel).threshold));
            sides.read(by, pressure, tangential)
        }
        Some(_) => Ok(Tangential::default()),
    };
    match felt {
        Ok(Tangential { forces, .. }) => (Reading::Value(libm::hypot(forces[0], forces[1]), true), forces),
        Err(Unknown::Missing) => (Reading::Missing, [0.0; 2]),
        Err(Unknown::Faulty | Unknown::OutOfRange) => (Reading::Faulty, [0.0; 2]),
    }
}
