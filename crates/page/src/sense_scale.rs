//! The scales of temperatures, distances and tangential forces, as those of pressures: known at first, or growing with what is read.

use serde_json::{Value, json};

use super::scale::{ScaleFrom, step_up};
use somatic_engine::scene::SenseRanges;

/// The least steps in which a scale grows: 5 °C, and 1 mm.
const STEPS: [f64; 2] = [5.0, 1e-3];
/// A scale that grows has at least so many steps.
const MIN_STEPS: f64 = 2.0;
/// It has at most about so many; else its steps are larger ones.
const MAX_STEPS: f64 = 40.0;

/// The ends of a scale, °C, m or the unit of P.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ends {
    least: f64,
    most: f64,
    from: ScaleFrom,
}

/// The scales of temperatures, °C, of distances, m, and of the sizes of tangential forces, in the unit of P. The page uses the last one
/// where the scale of pressures is known by less, as what a recording has.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SenseScales {
    celsius: Option<Ends>,
    distance_m: Option<Ends>,
    shear: Option<Ends>,
}

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
        Self {
            celsius: ends([calibrated.celsius, recorded.celsius]),
            distance_m: ends([calibrated.distance_m, recorded.distance_m].map(from_0)),
            shear: ends([calibrated.shear, recorded.shear].map(from_0)),
        }
    }

    /// Grows to hold `seen`; whether it did.
    pub(super) fn grow(&mut self, seen: SenseRanges) -> bool {
        let own = [seen.celsius, from_0(seen.distance_m)];
        let before = *self;
        for ((ends, seen), step) in [&mut self.celsius, &mut self.distance_m].into_iter().zip(own).zip(STEPS) {
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
        // Forces have steps as pressures do. What pulls nowhere has no scale.
        let most = seen.shear.map_or(0.0, |[_, most]| most);
        let has_room = |ends: Ends| ends.from != ScaleFrom::Grown || most <= ends.most;
        if most > 0.0 && most.is_finite() && !self.shear.is_some_and(has_room) {
            self.shear = Some(Ends { least: 0.0, most: step_up(most), from: ScaleFrom::Grown });
        }
        *self != before
    }

    /// As messages have it: by sense its ends, and how they are known; null where nothing is.
    pub(super) fn json(&self) -> Value {
        let [temperature, proximity, shear] = [self.celsius, self.distance_m, self.shear]
            .map(|ends| ends.map(|ends| json!({"least": ends.least, "most": ends.most, "from": ends.from.word()})));
        json!({"temperature": temperature, "proximity": proximity, "shear": shear})
    }
}

/// Distances and sizes begin at 0.
fn from_0(range: Option<[f64; 2]>) -> Option<[f64; 2]> {
    range.map(|[_, most]| [0.0, most])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(celsius: Option<[f64; 2]>, distance_m: Option<[f64; 2]>) -> SenseRanges {
        SenseRanges { celsius, distance_m, shear: None }
    }

    #[test]
    fn tangential_forces_have_a_scale_that_is_known_or_grows_as_that_of_pressures() {
        let of = |most: f64| SenseRanges { shear: Some([0.01, most]), ..SenseRanges::default() };
        let none = SenseRanges::default();
        let mut known = SenseScales::new(of(7.5), of(0.3));
        assert_eq!(known.json()["shear"], json!({"least": 0.0, "most": 7.5, "from": "raw range"}));
        let mut recorded = SenseScales::new(none, of(0.3));
        assert_eq!(recorded.json()["shear"], json!({"least": 0.0, "most": 0.3, "from": "recording"}));
        assert!(!known.grow(of(99.0)) && !recorded.grow(of(99.0)), "they are fixed");
        let mut grown = SenseScales::new(none, none);
        let most = |grown: &SenseScales| grown.json()["shear"]["most"].as_f64();
        assert!(!grown.grow(of(0.0)) && most(&grown).is_none(), "nothing has pulled");
        let steps = [0.05, 0.19, 0.1, 8.5].map(|size| (grown.grow(of(size)), most(&grown).unwrap()));
        assert!(steps.map(|(has_grown, _)| has_grown) == [true, true, false, true], "{steps:?}");
        for ((_, most), right) in steps.into_iter().zip([0.05, 0.2, 0.2, 10.0]) {
            assert!((most - right).abs() < 1e-12, "{steps:?}");
        }
        assert!(!grown.grow(of(f64::INFINITY)) && grown.json()["shear"]["from"] == "grown");
        assert_eq!(grown.json()["temperature"], Value::Null);
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
