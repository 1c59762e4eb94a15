//! The simulation's file: its keys.

use serde::{Deserialize, Deserializer};
use toml::Spanned;

use crate::keys::{whole, whole_as};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    pub(super) body: Option<Spanned<String>>,
    pub(super) rate_hz: Spanned<f64>,
    pub(super) duration_s: Spanned<f64>,
    #[serde(default)]
    pub(super) seed: u64,
    pub(super) layer: Option<LayerKeys>,
    #[serde(default)]
    pub(super) sensor: SensorKeys,
    #[serde(default)]
    pub(super) temperature: TemperatureKeys,
    #[serde(default)]
    pub(super) proximity: ProximityKeys,
    #[serde(default)]
    pub(super) calibration: CalibrationKeys,
    #[serde(default)]
    pub(super) touch: Vec<Spanned<TouchKeys>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LayerKeys {
    pub(super) thickness_m: Spanned<f64>,
    pub(super) spread: Option<Spanned<f64>>,
    pub(super) stiffness_pa: Option<Spanned<f64>>,
    pub(super) kernel: Option<Spanned<KernelName>>,
    pub(super) contact: Option<Spanned<ContactName>>,
}

#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
pub(super) enum KernelName {
    #[default]
    Gaussian,
    Boussinesq,
    Exponential,
    Bonded,
}

impl KernelName {
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Gaussian => "gaussian",
            Self::Boussinesq => "boussinesq",
            Self::Exponential => "exponential",
            Self::Bonded => "bonded",
        }
    }
}

#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
pub(super) enum ContactName {
    Gaussian,
    Hertz,
}

/// Temperature sensors and what they are in.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TemperatureKeys {
    pub(super) ambient_celsius: Option<Spanned<f64>>,
    pub(super) time_constant_s: Option<Spanned<f64>>,
    /// °C
    pub(super) noise_sigma: Option<Spanned<f64>>,
}

/// Distance sensors.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ProximityKeys {
    pub(super) range_m: Option<Spanned<f64>>,
    /// mm
    pub(super) noise_sigma: Option<Spanned<f64>>,
}

/// What the calibration says of these sensors that is not so.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CalibrationKeys {
    pub(super) dead_band: Option<Spanned<f64>>,
}

#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
pub(super) enum SensorName {
    #[default]
    Ideal,
    Fsr,
    Linear,
}

#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
pub(super) enum OutputName {
    Counts,
    Logarithmic,
    Linearised,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SensorKeys {
    pub(super) kind: Option<Spanned<SensorName>>,
    pub(super) wiper: Option<Spanned<i64>>,
    pub(super) output: Option<Spanned<OutputName>>,
    pub(super) full_scale_newton: Option<Spanned<f64>>,
    pub(super) offset: Option<Spanned<f64>>,
    pub(super) gain: Option<Spanned<f64>>,
    pub(super) bits: Option<Spanned<i64>>,
    pub(super) invert: Option<Spanned<bool>>,
    pub(super) area_m2: Option<Spanned<f64>>,
    pub(super) covers: Option<Spanned<CoversName>>,
    pub(super) noise_sigma: Option<Spanned<f64>>,
    pub(super) gain_spread: Option<Spanned<f64>>,
    #[serde(default)]
    pub(super) gain_seed: u64,
    pub(super) threshold_newton: Option<Spanned<f64>>,
    pub(super) drift_per_minute: Option<Spanned<f64>>,
    pub(super) crosstalk: Option<Spanned<f64>>,
    pub(super) hysteresis: Option<Spanned<f64>>,
    #[serde(default)]
    pub(super) dead: Vec<Spanned<i64>>,
    #[serde(default)]
    pub(super) stuck: Vec<StuckKeys>,
    #[serde(default)]
    pub(super) noisy: Vec<NoisyKeys>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StuckKeys {
    pub(super) taxel: Spanned<i64>,
    pub(super) at: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct NoisyKeys {
    pub(super) taxel: Spanned<i64>,
    pub(super) sigma: Spanned<f64>,
}

#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
pub(super) enum IndenterName {
    Rod,
    Ball,
    Fingertip,
    Flat,
    Edge,
    Ellipsoid,
    Strap,
    Pair,
}

/// What a taxel feels of touches of the whole body.
#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
pub(super) enum CoversName {
    Cell,
    Area,
}

/// A place of a path: (u, v) in a field, (x, y, z) in a link, or one of the whole body.
#[derive(Deserialize)]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "`path` has places [u, v], [x, y, z], { taxel = ID } or { link = \"NAME\", at = [x, y, z] }"
)]
pub(super) enum WaypointKeys {
    Numbers(Vec<f64>),
    Taxel { taxel: i64 },
    Place { link: String, at: [f64; 3] },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TouchKeys {
    pub(super) name: Option<String>,
    pub(super) on: Spanned<String>,
    pub(super) indenter: Spanned<IndenterName>,
    pub(super) radius_m: Option<Spanned<f64>>,
    pub(super) length_m: Option<Spanned<f64>>,
    pub(super) width_m: Option<Spanned<f64>>,
    #[serde(default, deserialize_with = "whole")]
    pub(super) radii_m: Option<Spanned<[f64; 3]>>,
    pub(super) apart_m: Option<Spanned<f64>>,
    pub(super) aspect: Option<Spanned<f64>>,
    pub(super) angle_deg: Option<Spanned<AngleKeys>>,
    pub(super) path: Spanned<Vec<Spanned<WaypointKeys>>>,
    pub(super) times_s: Option<Spanned<Vec<f64>>>,
    pub(super) start_s: Option<Spanned<f64>>,
    pub(super) speed_m_s: Option<Spanned<f64>>,
    #[serde(default, deserialize_with = "over_time")]
    pub(super) force_newton: Option<OverTime>,
    pub(super) tap: Option<Spanned<TapKeys>>,
    pub(super) press: Option<Spanned<PressKeys>>,
    pub(super) hold: Option<Spanned<HoldKeys>>,
    pub(super) friction: Option<Spanned<f64>>,
    #[serde(default, deserialize_with = "over_time")]
    pub(super) twist_deg: Option<OverTime>,
    pub(super) celsius: Option<Spanned<f64>>,
    #[serde(default, deserialize_with = "over_time")]
    pub(super) gap_m: Option<OverTime>,
}

/// Times in seconds, and values at them.
type OverTime = Spanned<Vec<[f64; 2]>>;

fn over_time<'de, D: Deserializer<'de>>(from: D) -> Result<Option<OverTime>, D::Error> {
    whole_as(from, || "[[t, value], …], t in seconds".to_owned())
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "`angle_deg` is a number of degrees, or a list of [t, degrees]")]
pub(super) enum AngleKeys {
    Fixed(f64),
    Turning(Vec<[f64; 2]>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TapKeys {
    pub(super) at_s: Spanned<Vec<f64>>,
    pub(super) newton: Spanned<f64>,
    pub(super) lasts_s: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PressKeys {
    pub(super) from_s: Spanned<f64>,
    pub(super) to_s: Spanned<f64>,
    pub(super) newton: Spanned<f64>,
    pub(super) ramp_s: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HoldKeys {
    pub(super) newton: Spanned<f64>,
}

#[cfg(test)]
mod tests {
    use super::File;
    use crate::keys::Text;

    #[test]
    fn what_changes_over_time_says_how_it_is_written() {
        let why = |key: &str| {
            let text = format!(
                "rate_hz = 50\nduration_s = 2\n[[touch]]\non = \"pad\"\nindenter = \"ball\"\npath = [[0, 0]]\n{key}\n"
            );
            Text(&text).parse::<File>().err().map(|e| e.to_string())
        };
        for (key, value) in
            [("gap_m", "0.05"), ("twist_deg", "20"), ("force_newton", "[0, 10]"), ("gap_m", "[[0, \"a\"]]")]
        {
            let column = key.len() + 4;
            let right = format!("line 7, column {column}: this must be [[t, value], …], t in seconds");
            assert_eq!(why(&format!("{key} = {value}")), Some(right));
        }
        assert_eq!(why("gap_m = [[0, 0.05], [1, 0]]"), None);
    }
}
