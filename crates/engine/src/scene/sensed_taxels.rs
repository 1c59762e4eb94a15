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

impl SensedValue {
    /// The least distance that is read, m: nearer ones are this one.
    pub const LEAST_DISTANCE_M: f64 = LEAST_M;
}

/// Least and greatest temperatures, °C, distances, m, and sizes of tangential forces, in the unit of P.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SenseRanges {
    /// °C; `None` where none is known.
    pub celsius: Option<[f64; 2]>,
    /// m; `None` where none is known.
    pub distance_m: Option<[f64; 2]>,
    /// Of single taxels, in the unit of P; `None` where none is known.
    pub shear: Option<[f64; 2]>,
}

impl SenseRanges {
    /// Takes in what a taxel reads, if it is in range.
    pub fn see(&mut self, value: &SensedValue) {
        let Reading::Value(number, true) = value.reading else { return };
        let range = match value.receptor {
            Receptor::Temperature => &mut self.celsius,
            Receptor::Proximity => &mut self.distance_m,
            Receptor::Shear => &mut self.shear,
            Receptor::Sustained | Receptor::Change => return,
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
        Self {
            celsius: both(self.celsius, other.celsius),
            distance_m: both(self.distance_m, other.distance_m),
            shear: both(self.shear, other.shear),
        }
    }

    /// Those that the calibration of `plan` allows to its `taxels`, where it has ends: by raw ranges, of distances by the range too. Of
    /// tangential forces without what `cross_axis` makes of P.
    #[must_use]
    pub fn of_calibration(plan: &Plan, taxels: &SensedTaxels) -> Self {
        let own = |wanted: Receptor| {
            let own = taxels.all().filter(move |&(_, receptor, _)| receptor == wanted);
            own.map(|(taxel, ..)| taxel)
        };
        let ends = |by: &SenseCalibration, receptor: Receptor| {
            let read = own(receptor).map(|taxel| by.of_taxel(taxel)).filter(|sense| !sense.mask);
            let known: Vec<f64> =
                read.flat_map(|sense| sense.raw_range.map(|end| sense.value_at(end))).collect::<Option<_>>()?;
            known.into_iter().map(|end| [end; 2]).reduce(|[low, high], [end, _]| [low.min(end), high.max(end)])
        };
        let shear = |by: &ShearCalibration| {
            let channels = own(Receptor::Shear).filter_map(|taxel| plan.body_taxels.binary_search(&taxel).ok());
            let read = channels.filter(|&channel| !plan.calibrations[channel].mask);
            let known: Vec<f64> = read.map(|channel| most_shear(by, plan, channel)).collect::<Option<_>>()?;
            known.into_iter().reduce(f64::max).map(|most| [0.0, most])
        };
        let distance = |by: &SenseCalibration| match by.range_m {
            range_m if range_m.is_finite() => Some([0.0, range_m]),
            _ => ends(by, Receptor::Proximity),
        };
        Self {
            celsius: plan.senses.temperature.as_ref().and_then(|by| ends(by, Receptor::Temperature)),
            distance_m: plan.senses.proximity.as_ref().and_then(distance),
            shear: plan.senses.shear.as_ref().and_then(shear),
        }
    }
}

/// The largest tangential force that the taxel of `channel` can read, if its range has ends: at a corner of what both values can be.
fn most_shear(by: &ShearCalibration, plan: &Plan, channel: usize) -> Option<f64> {
    let (taxel, calibration) = (plan.body_taxels[channel], &plan.calibrations[channel]);
    let gains = by.gains_of(taxel, calibration.gain, calibration.unit_factor);
    let [low, high] = by.range_of(taxel);
    let corners = [[low, low], [low, high], [high, low], [high, high]];
    let sizes = corners.map(|corner| {
        let [along, across] = by.forces(by.rest_of(taxel), gains, 0.0, corner);
        libm::hypot(along, across)
    });
    // Where there are no ends, a corner may be NaN.
    let are_known = sizes.iter().all(|&size| size <= calibrate::HUGE);
    are_known.then(|| sizes.into_iter().fold(0.0, f64::max))
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
        self.taxels.iter().map(move |own| own.read(plan, raw, sensed))
    }

    /// The same of the taxel at `taxel` in the body alone, if it is one of them, with which of [`SensedTaxels::channels`] its values are.
    #[must_use]
    pub fn read_one(
        &self,
        taxel: usize,
        plan: &Plan,
        raw: &[RawValue],
        sensed: &[RawValue],
    ) -> Option<(SensedValue, [usize; 2])> {
        let own = &self.taxels[self.taxels.binary_search_by_key(&taxel, |own| own.taxel).ok()?];
        Some((own.read(plan, raw, sensed), own.values))
    }
}

impl SensedTaxel {
    fn read(&self, plan: &Plan, raw: &[RawValue], sensed: &[RawValue]) -> SensedValue {
        let value = |at: usize| sensed.get(at).copied().unwrap_or(RawValue::MISSING);
        let (raw_value, senses) = (value(self.values[0]), &plan.senses);
        let (reading, shear) = match self.receptor {
            Receptor::Shear => match &senses.shear {
                Some(by) => pulled(by, plan, self.taxel, raw, self.values.map(value)),
                None => (Reading::Missing, [0.0; 2]),
            },
            Receptor::Proximity => {
                let by = senses.proximity.as_ref().map(|by| (by.of_taxel(self.taxel), by.range_m));
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
                (by.map_or(Reading::Missing, |by| by.of_taxel(self.taxel).read(raw_value)), [0.0; 2])
            }
        };
        SensedValue { taxel: self.taxel, receptor: self.receptor, raw: raw_value, reading, shear }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundled;
    use crate::field::FieldSet;
    use crate::percept::Outputs;
    use crate::scene::Scene;
    use crate::signal::{Calibration, Letter};
    use crate::touch;

    fn sensing_hand() -> Body {
        Body::from_bytes("sensing-hand", bundled::SENSING_HAND).unwrap()
    }

    fn plan(body: &Body, scene: &Scene, text: &str) -> Plan {
        let kinds: Vec<_> = body.taxels.iter().map(|taxel| (taxel.id, taxel.modality)).collect();
        let calibration = Calibration::parse_for(text, &kinds).unwrap();
        Plan::new(body, &FieldSet::new(body).unwrap(), scene, &calibration).unwrap()
    }

    fn ranges(body: &Body, text: &str) -> SenseRanges {
        let plan = plan(body, &Scene::default(), text);
        SenseRanges::of_calibration(&plan, &SensedTaxels::new(&plan, body))
    }

    /// The indices of the taxels of `body` that `receptor` reads.
    fn of_kind(body: &Body, receptor: Receptor) -> Vec<usize> {
        (0..body.taxels.len()).filter(|&taxel| receptor.reads(body.taxels[taxel].modality)).collect()
    }

    #[test]
    fn a_masked_taxel_and_a_code_without_a_reading_leave_the_ends_of_a_scale_as_they_are() {
        let body = sensing_hand();
        let [first, second] = [0, 1].map(|at| body.taxels[of_kind(&body, Receptor::Temperature)[at]].id);
        let near = body.taxels[of_kind(&body, Receptor::Proximity)[0]].id;
        let ranges = |text: &str| ranges(&body, text);
        let text = "[temperature]\ngain = 0.5\nraw_range = [0, 8190]\n[proximity]\nraw_range = [10, 90]\n";
        let plain = ranges(text);
        assert_eq!((plain.celsius, plain.distance_m), (Some([0.0, 4095.0]), Some([0.01, 0.09])));
        assert_eq!(ranges(&text.replace("8190]", "8190]\nmissing = [8190]")), plain);
        let masked = format!("{text}[taxel.{first}]\nmask = true\n[taxel.{near}]\nmask = true\n");
        assert_eq!(ranges(&masked), plain);
        // One that is read counts, one that is not does not.
        let own = |mask: bool| ranges(&format!("{text}[taxel.{second}]\nraw_range = [0, 9000]\nmask = {mask}\n"));
        assert_eq!((own(false).celsius, own(true)), (Some([0.0, 4500.0]), plain));
        // No temperature is under 0 K, and none is made up.
        assert_eq!(ranges("[temperature]\nraw_range = [-300, 50]\n").celsius, None);
        assert_eq!(ranges("").celsius, None);
    }

    #[test]
    fn the_most_shear_is_that_of_the_farthest_corner_of_the_raw_range() {
        let body = sensing_hand();
        let shear = |text: &str| ranges(&body, &format!("[all]\nunit = \"N\"\n{text}")).shear;
        let pulled = body.taxels[of_kind(&body, Receptor::Shear)[0]].id;
        // From rest at 10 and 20 to −290 and −280, times 0.01 and 0.02.
        let own = "[shear]\nbaseline = [10, 20]\ngain = [0.01, 0.02]\nraw_range = [-290, 100]\n";
        let [_, most] = shear(own).unwrap();
        assert!((most - 3.0_f64.hypot(6.2)).abs() < 1e-12, "{most}");
        let wider = |mask: bool| {
            let all = "[all]\nunit = \"N\"\n";
            let taxel = format!("[taxel.{pulled}]\nshear_raw_range = [-9990, 0]\nmask = {mask}\n");
            ranges(&body, &format!("{all}{own}{taxel}")).shear.unwrap()[1]
        };
        assert!((wider(false) - 100.0_f64.hypot(200.2)).abs() < 1e-9 && wider(true) == most);
        assert_eq!([shear(""), shear("[shear]\ngain = 2\n")], [None; 2]);
    }

    #[test]
    fn taxels_of_temperature_are_read_for_touches_alone() {
        let body = sensing_hand();
        let warm = of_kind(&body, Receptor::Temperature);
        let read = |scene: Scene| {
            let plan = plan(&body, &scene.outputs(Outputs::TOTAL), "");
            let sensed = SensedTaxels::new(&plan, &body);
            let of_letter = |wanted: Receptor| {
                let own = sensed.all().filter(|&(_, receptor, _)| receptor == wanted);
                own.map(|(taxel, ..)| taxel).collect::<Vec<_>>()
            };
            [Receptor::Temperature, Receptor::Shear, Receptor::Proximity].map(of_letter)
        };
        let touches = || Scene::default().touches(touch::Options::default());
        assert!(!warm.is_empty());
        assert_eq!(read(touches()), [warm, of_kind(&body, Receptor::Shear), Vec::new()]);
        // What reads pressures alone has neither.
        let none: [Vec<usize>; 3] = Default::default();
        assert_eq!(read(touches().letters(Letter::all_of(&[Receptor::Sustained], &[]))), none);
        assert_eq!(read(Scene::default()), none);
    }

    #[test]
    fn one_taxel_reads_what_it_reads_among_all() {
        let body = sensing_hand();
        let text = "[all]\nunit = \"N\"\n[proximity]\nrange = 80\n";
        let plan = plan(&body, &Scene::default().touches(touch::Options::default()), text);
        let taxels = SensedTaxels::new(&plan, &body);
        let values = |count: usize| (0..count).map(|at| RawValue::new((at % 50) as f64)).collect::<Vec<_>>();
        let (raw, sensed) = (values(plan.channels()), values(taxels.channels().len()));
        let all: Vec<SensedValue> = taxels.read(&plan, &raw, &sensed).collect();
        let channels = taxels.all().map(|(_, _, channels)| channels);
        assert!(all.len() > 10);
        for (value, channels) in all.iter().zip(channels) {
            assert_eq!(taxels.read_one(value.taxel, &plan, &raw, &sensed), Some((*value, channels)));
        }
        let others = (0..body.taxels.len()).filter(|taxel| all.iter().all(|value| value.taxel != *taxel));
        assert!(others.map(|taxel| taxels.read_one(taxel, &plan, &raw, &sensed)).all(|read| read.is_none()));
    }
}
