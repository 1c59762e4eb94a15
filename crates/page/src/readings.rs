//! Pressure and health of every taxel, from a frame's raw values: on the server's thread, and only for frames that a
//! viewer gets.

use super::senses::PageSenses;
use super::snapshot::Snapshot;
use crate::signal::{RawValue, Reading as SenseReading, Receptor};
use somatic_engine::percept::Flags;
use somatic_engine::scene::{Plan, SenseRanges, SensedValue};
use somatic_engine::stage::calibrate::{UNUSABLE, reference};

/// How a taxel is doing, as frames number it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Health {
    Good,
    Missing,
    Stale,
    Faulty,
    Saturated,
    OutOfRange,
    /// By the calibration, by drift compensation, or because no field of the run holds it.
    LeftOut,
    /// The source has no value for it, in no frame.
    NotSent,
}

impl Health {
    /// As messages spell it.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Missing => "missing",
            Self::Stale => "stale",
            Self::Faulty => "faulty",
            Self::Saturated => "saturated",
            Self::OutOfRange => "out of range",
            Self::LeftOut => "left out",
            Self::NotSent => "not sent",
        }
    }
}

/// What one taxel reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reading {
    pub(super) raw: Option<f64>,
    /// Its pressure; of taxels that measure something else °C or m.
    pub(super) pressure: Option<f64>,
    pub(super) health: Health,
}

/// What all taxels of a scene read in one frame.
#[derive(Debug)]
pub(super) struct Readings {
    plan: Plan,
    /// By the plan's channels, whether frames have their values.
    is_sent: Vec<bool>,
    /// By taxel; NaN where there is none. Of taxels that measure something else, °C or m.
    pressures: Vec<f32>,
    /// By taxel, as [`Health`].
    health: Vec<u8>,
    /// What they are made of.
    raw: Vec<RawValue>,
    /// Channels that were out of range before they were corrected.
    out_of_range: Vec<usize>,
    /// Taxels that read something else, if there are any; their values and states are among those above.
    senses: Option<Sensed>,
    /// Counts the frames that read differently from the one before.
    changes: u64,
}

/// Readings of other letters than pressure.
#[derive(Debug)]
struct Sensed {
    of: PageSenses,
    /// What they are made of.
    raw: Vec<RawValue>,
    /// Along both tangents of each taxel with three axes; NaN where they are not known.
    shears: Vec<f32>,
    ranges: SenseRanges,
}

impl Sensed {
    /// What the value `value` of `senses` says of its taxel, whose values are at `channels`.
    fn reading(&self, value: &SensedValue, channels: [usize; 2]) -> Reading {
        let is_sent = channels.iter().any(|&channel| self.of.is_sent[channel]);
        let (number, health) = match value.reading {
            SenseReading::Missing if !is_sent => (None, Health::NotSent),
            SenseReading::Missing if value.raw == RawValue::STALE => (None, Health::Stale),
            SenseReading::Missing => (None, Health::Missing),
            SenseReading::Faulty => (None, Health::Faulty),
            // Nothing is near.
            SenseReading::Value(_, false) if value.receptor == Receptor::Proximity => (None, Health::OutOfRange),
            SenseReading::Value(number, false) => (Some(number), Health::OutOfRange),
            SenseReading::Value(number, true) => (Some(number), Health::Good),
        };
        Reading { raw: value.raw.number(), pressure: number, health }
    }
}

impl Readings {
    /// For `taxels` taxels; `plan` reads some of them. `value_of` has the index of each channel's value in a frame.
    pub(super) fn new(plan: Plan, taxels: usize, value_of: &[Option<usize>], senses: Option<&PageSenses>) -> Self {
        Self {
            is_sent: value_of.iter().map(Option::is_some).collect(),
            plan,
            pressures: vec![f32::NAN; taxels],
            health: vec![Health::LeftOut as u8; taxels],
            raw: Vec::new(),
            out_of_range: Vec::new(),
            senses: senses.map(|of| Sensed {
                of: of.clone(),
                raw: Vec::new(),
                shears: Vec::new(),
                ranges: SenseRanges::default(),
            }),
            changes: 0,
        }
    }

    pub(super) fn pressures(&self) -> &[f32] {
        &self.pressures
    }

    pub(super) fn health(&self) -> &[u8] {
        &self.health
    }

    pub(super) fn changes(&self) -> u64 {
        self.changes
    }

    /// The tangential forces of taxels with three axes, two of each, if there are such taxels.
    pub(super) fn shears(&self) -> &[f32] {
        self.senses.as_ref().map_or(&[], |senses| &senses.shears)
    }

    /// The least and greatest temperatures, distances and tangential forces that were read.
    pub(super) fn sense_ranges(&self) -> SenseRanges {
        self.senses.as_ref().map_or_else(SenseRanges::default, |senses| senses.ranges)
    }

    /// Reads `snapshot`; the largest pressure in it.
    pub(super) fn read(&mut self, snapshot: &Snapshot) -> f64 {
        let has_sensed = self.senses.as_ref().is_some_and(|senses| senses.raw != snapshot.sensed);
        let is_changed = self.raw != snapshot.raw || self.out_of_range != snapshot.out_of_range;
        if self.take_baselines(snapshot) || is_changed || has_sensed {
            self.raw.clone_from(&snapshot.raw);
            self.out_of_range.clone_from(&snapshot.out_of_range);
            self.changes += 1;
            for channel in 0..self.raw.len() {
                let reading = self.of_channel(channel, snapshot);
                let taxel = self.plan.body_taxels[channel];
                self.pressures[taxel] = reading.pressure.map_or(f32::NAN, |pressure| pressure as f32);
                self.health[taxel] = reading.health as u8;
            }
            self.read_senses(snapshot);
        }
        // NaN is not a maximum.
        let pressed = self.plan.body_taxels.iter().map(|&taxel| self.pressures[taxel]);
        f64::from(pressed.fold(0.0, f32::max))
    }

    /// Reads what is not pressure; those with three axes are pressed, too.
    fn read_senses(&mut self, snapshot: &Snapshot) {
        let Some(mut senses) = self.senses.take() else { return };
        senses.raw.clone_from(&snapshot.sensed);
        senses.shears.clear();
        senses.ranges = SenseRanges::default();
        let places = senses.of.taxels.all().map(|(_, _, channels)| channels);
        let values: Vec<(SensedValue, [usize; 2])> =
            senses.of.taxels.read(&self.plan, &self.raw, &senses.raw).zip(places).collect();
        for (value, channels) in values {
            senses.ranges.see(&value);
            if value.receptor == Receptor::Shear {
                let is_known = matches!(value.reading, SenseReading::Value(..));
                senses.shears.extend(value.shear.map(|along| if is_known { along as f32 } else { f32::NAN }));
                continue;
            }
            let reading = senses.reading(&value, channels);
            self.pressures[value.taxel] = reading.pressure.map_or(f32::NAN, |number| number as f32);
            self.health[value.taxel] = reading.health as u8;
        }
        self.senses = Some(senses);
    }

    /// What the taxel at index `taxel` reads in `snapshot`.
    pub(super) fn taxel(&mut self, snapshot: &Snapshot, taxel: usize) -> Reading {
        let Ok(channel) = self.plan.body_taxels.binary_search(&taxel) else {
            let sensed = self.senses.as_ref().and_then(|senses| {
                let taxels = &senses.of.taxels;
                let (value, channels) = taxels.read_one(taxel, &self.plan, &snapshot.raw, &snapshot.sensed)?;
                Some(senses.reading(&value, channels))
            });
            return sensed.unwrap_or(Reading { raw: None, pressure: None, health: Health::LeftOut });
        };
        if self.take_baselines(snapshot) {
            // What is read of all taxels is of another calibration.
            self.raw.clear();
        }
        self.of_channel(channel, snapshot)
    }

    fn take_baselines(&mut self, snapshot: &Snapshot) -> bool {
        let changed = self.plan.calibration_changes != snapshot.calibration_changes;
        if changed {
            self.plan.calibration_changes = snapshot.calibration_changes;
            for (taxel, &(baseline, mask)) in self.plan.calibrations.iter_mut().zip(&snapshot.baselines) {
                (taxel.baseline, taxel.mask) = (baseline, mask);
            }
            self.plan.set_tangential_baselines(&snapshot.tangential_baselines);
        }
        changed
    }

    fn of_channel(&self, channel: usize, snapshot: &Snapshot) -> Reading {
        let value = snapshot.raw[channel];
        let was_out_of_range = snapshot.out_of_range.binary_search(&channel).is_ok();
        let taxel = &self.plan.calibrations[channel];
        let pressure = reference(value, taxel, self.plan.curve_of(channel));
        let flags = Flags::from_bits_truncate(pressure.status & !UNUSABLE);
        let health = match () {
            () if taxel.mask => Health::LeftOut,
            () if !self.is_sent[channel] => Health::NotSent,
            () if value == RawValue::STALE => Health::Stale,
            () if value.is_missing() => Health::Missing,
            () if flags.contains(Flags::FAULTY_INPUT) => Health::Faulty,
            () if flags.contains(Flags::SATURATED) => Health::Saturated,
            () if was_out_of_range || flags.contains(Flags::OUT_OF_RANGE) => Health::OutOfRange,
            () => Health::Good,
        };
        let is_usable = matches!(health, Health::Good | Health::Saturated | Health::OutOfRange);
        Reading { raw: value.number(), pressure: is_usable.then_some(pressure.value), health }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use serde_json::{Value, json};

    use super::*;
    use crate::body::{Body, FieldSpec, Glb, MemberSpec, Modality, Taxel};
    use crate::bundled;
    use crate::field::FieldSet;
    use crate::signal::{Calibration, Channel, Quantity};
    use somatic_engine::backend::BackendKind;
    use somatic_engine::scene::Scene;
    use somatic_engine::{Engine, Options};

    #[test]
    fn what_is_wrong_with_a_taxel_is_distinguished_from_zero() {
        let body = Body::from_bytes("hand", bundled::HAND).unwrap();
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let text = format!("[all]\ngain = 0.5\np_max = 100\nraw_range = [-10, 500]\n[taxel.{}]\nmask = true", ids[6]);
        let calibration = Calibration::parse(&text, &ids).unwrap();
        let plan = Plan::new(&body, &FieldSet::new(&body).unwrap(), &Scene::default(), &calibration).unwrap();
        let mut snapshot = Snapshot::new(&plan);
        let values = [
            (RawValue::new(40.0), Some(20.0), Health::Good),
            (RawValue::MISSING, None, Health::Missing),
            (RawValue::STALE, None, Health::Stale),
            (RawValue::FAULTY, None, Health::Faulty),
            (RawValue::new(400.0), Some(200.0), Health::Saturated),
            (RawValue::new(-20.0), Some(0.0), Health::OutOfRange),
            (RawValue::new(40.0), None, Health::LeftOut),
            (RawValue::new(0.0), Some(0.0), Health::Good),
            (RawValue::MISSING, None, Health::NotSent),
        ];
        let mut value_of: Vec<Option<usize>> = (0..ids.len()).map(Some).collect();
        value_of[8] = None;
        for (raw, (value, ..)) in snapshot.raw.iter_mut().zip(values) {
            *raw = value;
        }
        let mut readings = Readings::new(plan, body.taxels.len() + 1, &value_of, None);
        assert_eq!(readings.read(&snapshot), 200.0);
        for (index, (_, pressure, health)) in values.into_iter().enumerate() {
            assert_eq!(readings.health()[index], health as u8);
            let seen = readings.pressures()[index];
            assert_eq!((!seen.is_nan()).then_some(f64::from(seen)), pressure, "{health:?}");
            let reading = readings.taxel(&snapshot, index);
            assert_eq!((reading.pressure, reading.health), (pressure, health));
        }
        assert_eq!(readings.health()[body.taxels.len()], Health::LeftOut as u8);
        assert_eq!(readings.changes(), 1);
        // The page knows them by the same numbers and words.
        let words = [&values[..7], &values[8..]].concat();
        let words: Vec<String> = words.iter().map(|(.., health)| format!("\"{}\"", health.word())).collect();
        let table = format!("HEALTH = [{}]", words.join(","));
        let plain = |text: &str| text.replace(char::is_whitespace, "").replace(",]", "]");
        assert!(plain(include_str!("web/wire.js")).contains(&plain(&table)), "{table}");
        readings.read(&snapshot);
        assert_eq!(readings.changes(), 1, "nothing has changed");
        (snapshot.baselines[0].0, snapshot.calibration_changes) = (20.0, 1);
        readings.read(&snapshot);
        assert_eq!((readings.changes(), readings.pressures()[0]), (2, 10.0));
    }

    /// Two taxels of each kind: 0 and 1 of three axes, 2 and 3 of temperature, 4 and 5 of proximity.
    fn of_all_kinds() -> Body {
        let mut glb = Glb::new();
        let link = glb.node("pad", None, DVec3::ZERO);
        let kinds = [Modality::Force3, Modality::Temperature, Modality::Proximity];
        let taxel = |id: u32| Taxel {
            id,
            link: 0,
            position_in_link: DVec3::X * 0.01 * f64::from(id),
            normal_in_link: DVec3::Y,
            area: 1e-5,
            modality: kinds[id as usize / 2],
            tangent_in_link: (id < 2).then_some(DVec3::Z),
        };
        glb.taxels("taxels", Some(link), &(0..6).map(taxel).collect::<Vec<_>>(), None);
        let members = (0..6).map(|id| (id, MemberSpec::default())).collect();
        glb.field(&FieldSpec { name: "pad".into(), parent: None, members, chart: None }, Some(link), DVec3::ZERO);
        Body::from_bytes("pad", &glb.to_bytes().unwrap()).unwrap()
    }

    #[test]
    fn taxels_that_read_something_else_have_their_values_states_and_scales() {
        let body = of_all_kinds();
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let text = "[all]\nunit = \"N\"\n[proximity]\nunit = \"mm\"\nrange = 80\n";
        let calibration = Calibration::parse(text, &ids).unwrap();
        let plan = Plan::new(&body, &FieldSet::new(&body).unwrap(), &Scene::default(), &calibration).unwrap();
        let channels = Channel::all_of(&body);
        let senses = PageSenses::new(&body, &plan, &channels, SenseRanges::default()).unwrap();
        let welcome = senses.welcome(&senses.scales);
        assert_eq!(
            (&welcome["shear"], &welcome["temperature"], &welcome["proximity"]),
            (&json!([0, 1]), &json!([2, 3]), &json!([4, 5]))
        );
        assert_eq!(welcome["tangents"][0], json!([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]));
        assert_eq!(welcome["scales"]["proximity"]["most"], 0.08);
        assert_eq!(
            (welcome["scales"]["temperature"].clone(), plan.common_quantity()),
            (Value::Null, Some(Quantity::Newton))
        );

        let value_of: Vec<Option<usize>> = (0..plan.channels()).map(Some).collect();
        let mut snapshot = Snapshot::new(&plan);
        snapshot.raw = [2.0, 0.0].map(RawValue::new).to_vec();
        // Temperatures, distances in mm, then both tangential forces of each.
        let sensed = [Some(21.5), None, Some(30.0), Some(90.0), Some(0.5), Some(7.0), Some(-0.25), Some(7.0)];
        snapshot.sensed = sensed.map(|value| value.map_or(RawValue::MISSING, RawValue::new)).to_vec();
        let mut readings = Readings::new(plan.clone(), 6, &value_of, Some(&senses));
        assert_eq!(readings.read(&snapshot), 2.0, "the largest pressure is of no other kind");
        let health = [Health::Good, Health::Good, Health::Good, Health::Missing, Health::Good, Health::OutOfRange];
        assert_eq!(readings.health(), health.map(|health| health as u8));
        let values: Vec<Option<f32>> =
            readings.pressures().iter().map(|value| Some(*value).filter(|x| !x.is_nan())).collect();
        assert_eq!(values, [Some(2.0), Some(0.0), Some(21.5), None, Some(0.03), None]);
        // What is not pressed pulls nothing.
        assert_eq!(readings.shears(), [0.5, -0.25, 0.0, 0.0]);
        let ranges = readings.sense_ranges();
        assert_eq!((ranges.celsius, ranges.distance_m), (Some([21.5, 21.5]), Some([0.03, 0.03])));
        assert_eq!(ranges.shear, Some([0.0, 0.5_f64.hypot(0.25)]));
        let [warm, far] = [2, 5].map(|taxel| readings.taxel(&snapshot, taxel));
        assert_eq!((warm.raw, warm.pressure, warm.health), (Some(21.5), Some(21.5), Health::Good));
        assert_eq!((far.raw, far.pressure, far.health), (Some(90.0), None, Health::OutOfRange));

        snapshot.sensed[0] = RawValue::new(22.0);
        readings.read(&snapshot);
        assert_eq!((readings.changes(), readings.pressures()[2]), (2, 22.0), "what is sensed alone is a change");
        // What was out of range before it was corrected does not show in its value.
        snapshot.out_of_range = vec![0];
        readings.read(&snapshot);
        assert_eq!((readings.changes(), readings.health()[0]), (3, Health::OutOfRange as u8));
        assert_eq!([0, 1].map(|taxel| readings.taxel(&snapshot, taxel).health), [Health::OutOfRange, Health::Good]);
        assert_eq!(readings.pressures()[0], 2.0);
        // Without their channels they are not sent, and a plan of pressure alone has none of this.
        let unsent = PageSenses::new(&body, &plan, &ids[..2], SenseRanges::default()).unwrap();
        snapshot.sensed.fill(RawValue::MISSING);
        let mut readings = Readings::new(plan, 6, &value_of, Some(&unsent));
        readings.read(&snapshot);
        assert_eq!(readings.health()[2..], [Health::NotSent as u8; 4]);
        assert!(readings.shears().iter().all(|shear| shear.is_nan() || *shear == 0.0));
    }

    #[test]
    fn tangential_values_are_read_from_a_tare_on_as_the_engine_reads_them() {
        let body = of_all_kinds();
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let calibration = Calibration::parse("[all]\nunit = \"N\"\n[shear]\nbaseline = [5, 5]\n", &ids).unwrap();
        let seen = |tare: bool| {
            let options = Options::default().calibration(calibration.clone()).backend(BackendKind::Reference);
            let mut engine = Engine::new(&body, options.tare(tare)).unwrap();
            let channels = Channel::all_of(&body);
            let senses = PageSenses::new(&body, engine.plan(), &channels, SenseRanges::default()).unwrap();
            let value_of: Vec<Option<usize>> = (0..engine.plan().channels()).map(Some).collect();
            let mut readings = Readings::new(engine.plan().clone(), body.taxels.len(), &value_of, Some(&senses));
            let mut snapshot = Snapshot::new(engine.plan());
            let mut frame = engine.frame(0.0);
            // At rest, then pressed by 2 N and pulled by 3 N and 4 N more.
            for (number, values) in [[0.0, 100.0, 200.0], [2.0, 103.0, 204.0]].into_iter().enumerate() {
                frame.t_s = number as f64;
                for (name, value) in ["0", "0.u", "0.v"].into_iter().zip(values) {
                    let at = engine.index_of(name).unwrap();
                    frame.values[at] = RawValue::new(value);
                }
                engine.process_one(&frame).unwrap();
            }
            snapshot.take_baselines(engine.plan());
            snapshot.raw[0] = RawValue::new(2.0);
            snapshot.sensed = engine.values_sensed().to_vec();
            readings.read(&snapshot);
            let mut by_engine = Vec::new();
            engine.sensed(&frame, &senses.taxels, &mut by_engine);
            assert_eq!(by_engine[0].shear.map(|along| along as f32), readings.shears()[..2]);
            [readings.shears()[0], readings.shears()[1]]
        };
        assert_eq!(seen(true), [3.0, 4.0]);
        assert_eq!(seen(false), [98.0, 199.0], "from the file's rest");
    }
}
