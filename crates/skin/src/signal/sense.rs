//! What the other letters are made of: how raw values become temperatures, distances and tangential forces. In double precision.
//!
//! Temperature: T = gain · r(raw − baseline) + offset, in °C, or with r(baseline − raw) if it is inverted. Distance: the same in m. r is
//! the raw value itself, a table, or the temperature of a thermistor in a divider, by its B parameter: 1/T = 1/298.15 K + ln(R/R₂₅)/B.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use super::curve::Curve;
use super::frame::RawValue;
use super::response::Response;

/// 0 °C, K.
pub(super) const ZERO_CELSIUS_K: f64 = 273.15;
/// 2⁶⁰: what is larger is not believed, be it a raw value or what is made of one.
#[doc(hidden)]
pub const HUGE: f64 = 1_152_921_504_606_846_976.0;

/// What a raw value is in a sense.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// °C, m, or the unit of P; and whether the raw value is in the sensor's range.
    Value(f64, bool),
    /// No value arrived.
    Missing,
    /// It is not a number, or one that cannot be; or its taxel is masked.
    Faulty,
}

/// The conversion of one taxel's raw values.
#[derive(Clone, Debug, PartialEq)]
pub struct Sense {
    /// Raw value at 0.
    pub baseline: f64,
    /// °C or m for each raw unit, or what the response is multiplied by.
    pub gain: f64,
    /// What is added, °C or m.
    pub offset: f64,
    /// The least that a reading can be: absolute zero, °C; of distances there is none, as the nearest are counted as nearly touching.
    pub least: f64,
    /// The response before the gain.
    pub response: SenseResponse,
    /// Whether its response is at the baseline less the raw value (`invert`), not at the raw value less the baseline.
    pub falls: bool,
    /// The range of raw values; others are flagged `out_of_range`.
    pub raw_range: [f64; 2],
    /// Ignore this taxel.
    pub mask: bool,
    /// Raw values that are no readings, in single precision as raw values are.
    pub missing: Vec<f32>,
}

/// What a raw value above the baseline is, before the gain.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum SenseResponse {
    /// Itself.
    #[default]
    Linear,
    /// A table.
    Curve(Curve),
    /// A thermistor to ground under a resistor to the reference voltage, °C.
    Ntc {
        /// Its resistance at 25 °C, Ω.
        ohm_at_25: f64,
        /// Its B parameter, K.
        b_k: f64,
        /// The resistor above it, Ω.
        series_ohm: f64,
        /// The raw value of the reference voltage.
        full_raw: f64,
    },
}

impl Default for Sense {
    fn default() -> Self {
        Self {
            baseline: 0.0,
            gain: 1.0,
            offset: 0.0,
            least: f64::NEG_INFINITY,
            response: SenseResponse::Linear,
            falls: false,
            raw_range: [f64::NEG_INFINITY, f64::INFINITY],
            mask: false,
            missing: Vec::new(),
        }
    }
}

impl SenseResponse {
    /// At `above`, the raw value above the baseline; `None` where it has none.
    fn at(&self, above: f64) -> Option<f64> {
        match self {
            Self::Linear => Some(above),
            Self::Curve(curve) => Some(curve.value(above)),
            Self::Ntc { ohm_at_25, b_k, series_ohm, full_raw } => {
                // Open or shorted.
                if !(above > 0.0 && above < *full_raw) {
                    return None;
                }
                let ohm = series_ohm * above / (full_raw - above);
                let inverse_k = 1.0 / (ZERO_CELSIUS_K + 25.0) + (ohm / ohm_at_25).ln() / b_k;
                (inverse_k > 0.0).then(|| 1.0 / inverse_k - ZERO_CELSIUS_K)
            }
        }
    }
}

impl Sense {
    /// The same with the baseline of a thermistor above its resistor, if it is one: it is at full scale less the raw value.
    pub(super) fn above_resistor(mut self) -> Self {
        if let SenseResponse::Ntc { full_raw, .. } = self.response
            && self.falls
            && self.baseline == 0.0
        {
            self.baseline = full_raw;
        }
        self
    }

    /// Whether `raw` lies beyond the end of a curve where its values are least (`Less`) or greatest (`Greater`), or neither.
    #[must_use]
    pub fn end_beyond(&self, raw: RawValue) -> Ordering {
        let (SenseResponse::Curve(curve), Some(number)) = (&self.response, raw.number()) else {
            return Ordering::Equal;
        };
        // Raw values are rounded to single precision.
        curve.end_beyond(self.above(number), number.abs() * f64::from(f32::EPSILON))
    }

    /// The raw value `number` from the baseline, in the direction in which the response has it.
    fn above(&self, number: f64) -> f64 {
        if self.falls { self.baseline - number } else { number - self.baseline }
    }

    /// What `raw` is.
    #[must_use]
    pub fn read(&self, raw: RawValue) -> Reading {
        if raw.is_missing() {
            return Reading::Missing;
        }
        let Some(number) = raw.number().filter(|number| !self.mask && number.abs() <= HUGE) else {
            return Reading::Faulty;
        };
        if self.missing.contains(&(number as f32)) {
            return Reading::Missing;
        }
        match self.value_at(number) {
            Some(value) => Reading::Value(value, (self.raw_range[0]..=self.raw_range[1]).contains(&number)),
            None => Reading::Faulty,
        }
    }

    /// What the raw value `number` stands for, °C or m, also if the taxel is masked or `missing` lists it; `None` if it cannot be.
    #[must_use]
    pub fn value_at(&self, number: f64) -> Option<f64> {
        if number.abs() > HUGE {
            return None;
        }
        let value = self.response.at(self.above(number)).map(|response| self.gain * response + self.offset);
        value.filter(|&value| value.abs() <= HUGE && value >= self.least)
    }
}

/// The conversions of all taxels of a sense.
#[derive(Clone, Debug, PartialEq)]
pub struct SenseCalibration {
    /// Of taxels without keys of their own.
    pub all: Sense,
    /// By the taxel's place in the body.
    pub own: BTreeMap<usize, Sense>,
    /// The time over which rates are found, s.
    pub window_s: f64,
    /// The gain of `all` as it is written, in the unit of the file.
    pub written_gain: f64,
    /// The farthest distance that counts, m; infinite where none is given. Of temperatures it has no meaning.
    pub range_m: f64,
}

impl SenseCalibration {
    /// Of temperatures: °C, rates over 1 s.
    pub(super) fn of_temperature() -> Self {
        let all = Sense { least: -ZERO_CELSIUS_K, ..Sense::default() };
        Self { all, own: BTreeMap::new(), window_s: 1.0, written_gain: 1.0, range_m: f64::INFINITY }
    }

    /// Of distances: mm, speeds over 0.1 s.
    pub(super) fn of_proximity() -> Self {
        Self { all: Sense { gain: 1e-3, ..Sense::default() }, window_s: 0.1, ..Self::of_temperature() }
    }

    /// The same with baselines for thermistors above their resistors.
    pub(super) fn above_resistors(self) -> Self {
        let own = self.own.into_iter().map(|(taxel, sense)| (taxel, sense.above_resistor())).collect();
        Self { all: self.all.above_resistor(), own, ..self }
    }

    /// That of the body's taxel `taxel`.
    #[must_use]
    pub fn of_taxel(&self, taxel: usize) -> &Sense {
        self.own.get(&taxel).unwrap_or(&self.all)
    }
}

/// How raw values of taxels with three axes become forces along n, t and n × t, in the unit of P: each less its baseline, times the gain,
/// then C times these three.
#[derive(Clone, Debug, PartialEq)]
pub struct ShearCalibration {
    /// Raw values at rest, along t and n × t.
    pub baselines: [f64; 2],
    /// By the taxel's place in the body, where it has its own.
    pub own_baselines: BTreeMap<usize, [f64; 2]>,
    /// P for each raw unit, along t and n × t; `None` is the size of the taxel's own gain.
    pub gain: Option<[f64; 2]>,
    /// By the taxel's place in the body, where it has its own.
    pub own_gains: BTreeMap<usize, [f64; 2]>,
    /// The range of tangential raw values; others are not believed, and flagged `out_of_range`.
    pub raw_range: [f64; 2],
    /// By the taxel's place in the body, where it has its own.
    pub own_raw_ranges: BTreeMap<usize, [f64; 2]>,
    /// Standard deviation of a tangential raw value, raw units; `None` where it is not given.
    pub noise: Option<f64>,
    /// By the taxel's place in the body, where it has its own.
    pub own_noises: BTreeMap<usize, f64>,
    /// The first row of C: what of each measured force is in the normal one.
    pub into_normal: [f64; 3],
    /// The others, as if the measured normal force were P, which has `into_normal` in it: what of P and of each measured tangential
    /// force is in each tangential force.
    pub cross_axis: [[f64; 3]; 2],
    /// μ, the friction at which a contact slips, if it is known.
    pub slips_at: Option<f64>,
}

impl Default for ShearCalibration {
    fn default() -> Self {
        Self {
            baselines: [0.0; 2],
            own_baselines: BTreeMap::new(),
            gain: None,
            own_gains: BTreeMap::new(),
            raw_range: [f64::NEG_INFINITY, f64::INFINITY],
            own_raw_ranges: BTreeMap::new(),
            noise: None,
            own_noises: BTreeMap::new(),
            into_normal: ALONE_IN_NORMAL,
            cross_axis: [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            slips_at: None,
        }
    }
}

impl ShearCalibration {
    /// P for each raw unit of the tangential forces of the body's taxel `taxel`, whose normal force has a `gain` and is in a unit of
    /// which P has `unit_factor`.
    #[must_use]
    pub fn gains_of(&self, taxel: usize, gain: f64, unit_factor: f64) -> [f64; 2] {
        // Gains of its own are in the file's unit, as the normal one was before it came into N or Pa.
        let own = self.own_gains.get(&taxel).copied().or(self.gain);
        own.map_or([gain.abs(); 2], |own| own.map(|gain| gain * unit_factor))
    }

    /// The standard deviation of each tangential raw value of the body's taxel `taxel`, raw units; `None` where it is not given.
    #[must_use]
    pub fn noise_of(&self, taxel: usize) -> Option<f64> {
        self.own_noises.get(&taxel).copied().or(self.noise)
    }

    /// Whether [`ShearCalibration::gains_of`] the body's taxel `taxel` are some: its own gain is of raw values if its `response` is a line.
    #[must_use]
    pub fn has_gain(&self, taxel: usize, response: Response) -> bool {
        response == Response::Linear || self.gain.is_some() || self.own_gains.contains_key(&taxel)
    }

    /// The raw tangential values at rest of the body's taxel `taxel`.
    #[must_use]
    pub fn rest_of(&self, taxel: usize) -> [f64; 2] {
        self.own_baselines.get(&taxel).copied().unwrap_or(self.baselines)
    }

    /// The range of the raw tangential values of the body's taxel `taxel`.
    #[must_use]
    pub fn range_of(&self, taxel: usize) -> [f64; 2] {
        self.own_raw_ranges.get(&taxel).copied().unwrap_or(self.raw_range)
    }

    /// The forces along t and n × t, in the unit of P, of a taxel that feels `pressure` and has the raw values `tangential`, with
    /// `rest` ([`ShearCalibration::rest_of`]) and `gains` ([`ShearCalibration::gains_of`]).
    #[must_use]
    #[inline]
    pub fn forces(&self, rest: [f64; 2], gains: [f64; 2], pressure: f64, tangential: [f64; 2]) -> [f64; 2] {
        let [u, v] = [0, 1].map(|axis| gains[axis] * (tangential[axis] - rest[axis]));
        self.cross_axis.map(|[of_p, of_u, of_v]| of_p * pressure + of_u * u + of_v * v)
    }

    /// Whether forces along the skin change what is felt along the normal.
    #[must_use]
    pub fn leaks_into_normal(&self) -> bool {
        self.into_normal != ALONE_IN_NORMAL
    }
}

/// The first row of a C by which the normal force is what is measured along the normal.
const ALONE_IN_NORMAL: [f64; 3] = [1.0, 0.0, 0.0];

#[cfg(test)]
mod tests {
    use super::*;

    fn value(sense: &Sense, raw: f64) -> f64 {
        match sense.read(RawValue::new(raw)) {
            Reading::Value(value, _) => value,
            other => panic!("{raw}: {other:?}"),
        }
    }

    #[test]
    fn a_line_and_a_table_give_what_they_say() {
        let line = Sense { baseline: 100.0, gain: 0.5, offset: -10.0, raw_range: [0.0, 300.0], ..Sense::default() };
        assert_eq!(value(&line, 140.0), 10.0);
        assert_eq!(line.read(RawValue::new(301.0)), Reading::Value(90.5, false));
        let falling = Sense { falls: true, ..line.clone() };
        assert_eq!(value(&falling, 40.0), 20.0);
        let curve = SenseResponse::Curve(Curve::new(&[0.0, 10.0, 20.0], &[100.0, 20.0, 10.0]).unwrap());
        let table = Sense { response: curve, gain: 1e-3, ..Sense::default() };
        assert!((value(&table, 15.0) - 0.015).abs() < 1e-15 && value(&table, 99.0) == 0.01);
        let ends = |sense: &Sense| [-1.0, 0.0, 20.0, 21.0].map(|raw| sense.end_beyond(RawValue::new(raw)));
        use Ordering::{Equal, Greater, Less};
        assert_eq!(ends(&table), [Greater, Equal, Equal, Less]);
        assert_eq!(ends(&Sense { falls: true, baseline: 20.0, ..table }), [Less, Equal, Equal, Greater]);
        assert_eq!(ends(&falling), [Equal; 4]);
    }

    #[test]
    fn a_thermistor_is_at_25_degrees_where_it_is_as_its_resistor() {
        let ntc = SenseResponse::Ntc { ohm_at_25: 10e3, b_k: 3950.0, series_ohm: 10e3, full_raw: 1024.0 };
        let sense = Sense { response: ntc, ..Sense::default() };
        assert!((value(&sense, 512.0) - 25.0).abs() < 1e-9);
        // A hotter one has less resistance. At 50 °C R/R₂₅ = exp(B (1/323.15 − 1/298.15)).
        let ohm = 10e3 * (3950.0_f64 * (1.0 / 323.15 - 1.0 / 298.15)).exp();
        let raw = 1024.0 * ohm / (ohm + 10e3);
        assert!((value(&sense, raw) - 50.0).abs() < 1e-3);
        for open_or_shorted in [0.0, 1024.0, -1.0] {
            assert_eq!(sense.read(RawValue::new(open_or_shorted)), Reading::Faulty);
        }
    }

    #[test]
    fn what_is_no_reading_is_said() {
        let sense = Sense { missing: vec![30_000.0], ..Sense::default() };
        assert_eq!(sense.read(RawValue::MISSING), Reading::Missing);
        assert_eq!(sense.read(RawValue::new(30_000.0)), Reading::Missing);
        assert_eq!(sense.read(RawValue::FAULTY), Reading::Faulty);
        assert_eq!(sense.read(RawValue::new(1e19)), Reading::Faulty);
        let masked = Sense { mask: true, ..sense };
        assert_eq!(masked.read(RawValue::new(1.0)), Reading::Faulty);
        // What the numbers stand for is known all the same.
        assert_eq!(
            [1.0, 30_000.0, 1e19, f64::INFINITY].map(|number| masked.value_at(number)),
            [Some(1.0), Some(30_000.0), None, None]
        );
    }
}
