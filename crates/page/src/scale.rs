//! The scale of pressures: what the brightest colour stands for, and how that is known.

use crate::signal::RawValue;
use somatic_engine::scene::Plan;
use somatic_engine::stage::calibrate::{UNUSABLE, reference};

/// How the end of a scale is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ScaleFrom {
    /// The largest P_max of the calibration.
    Calibration,
    /// The ends of the calibration's raw ranges.
    RawRange,
    /// The largest pressure of the recording.
    Recording,
    /// The largest pressure so far, in steps.
    Grown,
}

impl ScaleFrom {
    /// As messages spell it.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Calibration => "calibration",
            Self::RawRange => "raw range",
            Self::Recording => "recording",
            Self::Grown => "grown",
        }
    }
}

/// The scale of pressures, in the unit of P.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    pub(super) max: f64,
    pub(super) from: ScaleFrom,
}

impl Scale {
    /// The scale of `plan`, or of a recording whose largest pressure is `recorded_max`, or one that grows.
    pub(super) fn for_plan(plan: &Plan, recorded_max: Option<f64>) -> Self {
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        let limit = f64::from(f32::MAX);
        let used = || plan.calibrations.iter().filter(|taxel| !taxel.mask);
        let p_max = largest(&mut used().map(|taxel| taxel.p_max).filter(|p_max| *p_max < limit));
        if p_max > 0.0 {
            return Self { max: p_max, from: ScaleFrom::Calibration };
        }
        let ends =
            plan.calibrations.iter().enumerate().filter(|(_, taxel)| !taxel.mask).flat_map(|(channel, taxel)| {
                let known = taxel.raw_range.into_iter().filter(|end| end.abs() < f32::MAX);
                known.map(move |end| reference(RawValue::new(end.into()), taxel, plan.curve_of(channel)))
            });
        let at_ends = largest(&mut ends.filter(|p| p.status & UNUSABLE == 0).map(|p| p.value));
        if at_ends > 0.0 {
            return Self { max: at_ends, from: ScaleFrom::RawRange };
        }
        match recorded_max.filter(|max| max.is_finite() && *max > 0.0) {
            Some(max) => Self { max, from: ScaleFrom::Recording },
            None => Self { max: 1.0, from: ScaleFrom::Grown },
        }
    }

    /// Grows to hold `pressure`, if it is one that grows; whether it did.
    pub(super) fn grow(&mut self, pressure: f64) -> bool {
        let grows = self.from == ScaleFrom::Grown && pressure > self.max && pressure.is_finite();
        if grows {
            self.max = step_up(pressure);
        }
        grows
    }
}

/// The least of …, 0.1, 0.2, 0.5, 1, 2, 5, 10, … that is at least `value` > 0.
pub(super) fn step_up(value: f64) -> f64 {
    let decade = 10_f64.powi(value.log10().floor() as i32);
    // The next decade's first where rounding has put `value` above the last.
    [1.0, 2.0, 5.0, 10.0, 20.0].into_iter().map(|step| step * decade).find(|step| *step >= value).unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Body;
    use crate::bundled;
    use crate::field::FieldSet;
    use crate::signal::Calibration;
    use somatic_engine::scene::Scene;

    #[test]
    fn steps_are_one_two_and_five() {
        for (value, step) in [(0.3, 0.5), (1.0, 1.0), (1.01, 2.0), (4.0, 5.0), (5.1, 10.0), (999.0, 1000.0)] {
            assert_eq!(step_up(value), step);
        }
        for exponent in -30..30 {
            let value = 10_f64.powi(exponent);
            assert!(step_up(value) >= value && step_up(value) <= 2.0 * value);
        }
    }

    #[test]
    fn the_best_known_end_counts() {
        let body = Body::from_bytes("hand", bundled::HAND).unwrap();
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let scale = |text: &str, recorded| {
            let calibration = Calibration::parse(text, &ids).unwrap();
            let fields = FieldSet::new(&body).unwrap();
            Scale::for_plan(&Plan::new(&body, &fields, &Scene::default(), &calibration).unwrap(), recorded)
        };
        let from = |max, from| Scale { max, from };
        assert_eq!(scale("[all]\np_max = 7", Some(3.0)), from(7.0, ScaleFrom::Calibration));
        assert_eq!(scale("[all]\nraw_range = [0, 100]\ngain = 0.5", Some(3.0)), from(50.0, ScaleFrom::RawRange));
        let inverted = "[all]\nraw_range = [0, 100]\nbaseline = 90\ninvert = true";
        assert_eq!(scale(inverted, None), from(90.0, ScaleFrom::RawRange));
        assert_eq!(scale("", Some(3.0)), from(3.0, ScaleFrom::Recording));
        let mut grown = scale("", None);
        assert_eq!(grown, from(1.0, ScaleFrom::Grown));
        assert!(!grown.grow(0.9) && grown.grow(3.0) && !grown.grow(f64::INFINITY) && !grown.grow(4.9));
        assert_eq!(grown.max, 5.0);
        assert!(!from(1.0, ScaleFrom::Recording).grow(9.0));
    }
}
