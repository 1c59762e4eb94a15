//! The scales of temperatures and distances, as those of pressures: known at first, or growing with what is read.

use serde_json::{Value, json};

use super::scale::ScaleFrom;
use somatic_engine::scene::SenseRanges;

/// The least steps in which a scale grows: 5 °C, and 1 mm.
const STEPS: [f64; 2] = [5.0, 1e-3];
/// A scale that grows has at least so many steps.
const MIN_STEPS: f64 = 2.0;
/// It has at most about so many; else its steps are larger ones.
const MAX_STEPS: f64 = 40.0;

/// The ends of a scale, °C or m.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ends {
    least: f64,
    most: f64,
    from: ScaleFrom,
}

/// The scales of temperatures, °C, and of distances, m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SenseScales([Option<Ends>; 2]);

impl SenseScales {
    /// By the calibration's own ranges, or by those of a recording; others grow.
    pub(super) fn new(calibrated: SenseRanges, recorded: SenseRanges) -> Self {
        let ends = |[calibrated, recorded]: [Option<[f64; 2]>; 2]| {
            let known = [(calibrated, ScaleFrom::RawRange), (recorded, ScaleFrom::Recording)];
            known.into_iter().find_map(|(ends, from)| {
                let [least, most] = ends.filter(|[least, most]| least < most && (most - least).is_finite())?;
                Some(Ends { least, most, from })
            })
        };
        Self([
            ends([calibrated.celsius, recorded.celsius]),
            // Distances begin at 0.
            ends([calibrated.distance_m, recorded.distance_m].map(|ends| ends.map(|[_, most]| [0.0, most]))),
        ])
    }

    /// Grows to hold `seen`; whether it did.
    pub(super) fn grow(&mut self, seen: SenseRanges) -> bool {
        let seen = [seen.celsius, seen.distance_m.map(|[_, most]| [0.0, most])];
        let before = *self;
        for ((ends, seen), step) in self.0.iter_mut().zip(seen).zip(STEPS) {
            let Some([low, high]) = seen.filter(|[low, high]| (high - low).is_finite()) else { continue };
            let (least, most) = match ends {
                Some(ends) if ends.from != ScaleFrom::Grown || (ends.least <= low && high <= ends.most) => continue,
                Some(ends) => (ends.least.min(low), ends.most.max(high)),
                None => (low, high),
            };
            let mut step = step;
            while (most - least) / step > MAX_STEPS {
                step *= 2.0;
            }
            let least = (least / step).floor() * step;
            let most = ((most / step).ceil() * step).max(least + MIN_STEPS * step);
            *ends = Some(Ends { least, most, from: ScaleFrom::Grown });
        }
        *self != before
    }

    /// As messages have it: by sense its ends, and how they are known; null where nothing is.
    pub(super) fn json(&self) -> Value {
        let [temperature, proximity] = self
            .0
            .map(|ends| ends.map(|ends| json!({"least": ends.least, "most": ends.most, "from": ends.from.word()})));
        json!({"temperature": temperature, "proximity": proximity})
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(celsius: Option<[f64; 2]>, distance_m: Option<[f64; 2]>) -> SenseRanges {
        SenseRanges { celsius, distance_m }
    }

    #[test]
    fn a_scale_is_the_calibrations_or_the_recordings_or_it_grows_in_round_steps() {
        let none = SenseRanges::default();
        let calibrated = SenseScales::new(of(Some([-10.0, 60.0]), Some([0.01, 0.08])), of(Some([20.0, 30.0]), None));
        let json = calibrated.json();
        assert_eq!(json["temperature"], json!({"least": -10.0, "most": 60.0, "from": "raw range"}));
        assert_eq!(json["proximity"], json!({"least": 0.0, "most": 0.08, "from": "raw range"}));
        let mut recorded = SenseScales::new(none, of(Some([20.0, 30.5]), None));
        assert_eq!(recorded.json()["temperature"], json!({"least": 20.0, "most": 30.5, "from": "recording"}));
        assert_eq!(recorded.json()["proximity"], Value::Null);
        assert!(!recorded.grow(of(Some([0.0, 99.0]), None)), "it is fixed");
        let mut grown = SenseScales::new(none, none);
        assert!(grown.grow(of(Some([21.3, 26.0]), Some([0.02, 0.0314]))) && !grown.grow(of(Some([22.0, 29.0]), None)));
        assert_eq!(grown.json()["temperature"], json!({"least": 20.0, "most": 30.0, "from": "grown"}));
        assert_eq!(grown.json()["proximity"]["most"], 0.032);
        assert!(grown.grow(of(Some([-3.0, 22.0]), None)));
        assert_eq!(grown.json()["temperature"], json!({"least": -5.0, "most": 30.0, "from": "grown"}));
        // One value alone has a scale around it; raw values of any size do not take long.
        let mut one = SenseScales::new(none, none);
        assert!(one.grow(of(Some([25.0, 25.0]), None)));
        assert_eq!(one.json()["temperature"], json!({"least": 25.0, "most": 35.0, "from": "grown"}));
        assert!(one.grow(of(Some([0.0, 1e18]), None)) && !one.grow(of(Some([f64::NEG_INFINITY, 0.0]), None)));
    }
}
