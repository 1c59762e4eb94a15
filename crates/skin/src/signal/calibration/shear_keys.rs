//! The keys of taxels with three axes: `[shear]`, and those of `[taxel.N]` that begin with `shear_`.

use std::ops::Range;

use serde::Deserialize;
use toml::{Spanned, Value};

use super::senses::{gain_of, range_of};
use crate::error::Result;
use crate::keys::{Text, Whole, whole};
use crate::signal::response::{GAIN_RANGE, MAX_MAGNITUDE};
use crate::signal::sense::ShearCalibration;

/// Of what one raw value of another axis is in a force.
const MOST_ACROSS: f64 = 1e6;

/// `[shear]`.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ShearKeys {
    #[serde(default, deserialize_with = "whole")]
    baseline: Option<Spanned<[f64; 2]>>,
    #[serde(default, deserialize_with = "whole")]
    gain: Option<Spanned<Gains>>,
    #[serde(default, deserialize_with = "whole")]
    raw_range: Option<Spanned<[f64; 2]>>,
    noise: Option<Spanned<Value>>,
    #[serde(default, deserialize_with = "whole")]
    cross_axis: Option<Spanned<Matrix>>,
    slips_at: Option<Spanned<f64>>,
}

/// The gains of u and v: `gain = 0.01` for both, or `gain = [0.01, 0.012]`.
#[derive(Clone, Copy)]
pub(super) struct Gains([f64; 2]);

/// A number or some.
#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a number, or a list of two: of u and of v")]
pub(super) enum NumberOrList {
    Number(f64),
    List(Vec<f64>),
}

impl Whole for Gains {
    type Read = NumberOrList;

    fn of_read(read: Self::Read) -> Result<Self, String> {
        match read {
            NumberOrList::Number(both) => Ok(Self([both; 2])),
            NumberOrList::List(list) => Whole::of_read(list).map(Self),
        }
    }
}

/// Shares of n, u and v, in n, in u and in v; two rows are of u and of v.
#[derive(Clone, Copy)]
pub(super) struct Matrix([[f64; 3]; 3]);

impl Whole for Matrix {
    type Read = Vec<Vec<f64>>;

    fn of_read(read: Self::Read) -> Result<Self, String> {
        let rows: Vec<[f64; 3]> = Whole::of_read(read)?;
        match rows[..] {
            [u, v] => Ok(Self([ShearCalibration::default().into_normal, u, v])),
            [n, u, v] => Ok(Self([n, u, v])),
            _ => Err(format!("a list has {} entries here; give it 2, or 3", rows.len())),
        }
    }
}

impl ShearKeys {
    pub(super) fn read(&self, text: Text<'_>) -> Result<ShearCalibration> {
        let mut shear = ShearCalibration::default();
        if let Some(baselines) = &self.baseline {
            shear.baselines = baselines_of("baseline", baselines, text)?;
        }
        if let Some(range) = &self.raw_range {
            shear.raw_range = range_of("raw_range", range, text)?;
        }
        shear.noise = self.noise.as_ref().map(|noise| noise_of("noise", noise, text)).transpose()?;
        shear.gain = self.gain.as_ref().map(|gains| gains_of("gain", gains, text)).transpose()?;
        if let Some(matrix) = &self.cross_axis {
            (shear.into_normal, shear.cross_axis) = rows_of(matrix, text)?;
        }
        if let Some(slips_at) = &self.slips_at {
            shear.slips_at = Some(text.positive("slips_at", slips_at)?);
        }
        Ok(shear)
    }

    /// Where `cross_axis` is.
    pub(super) fn matrix_at(&self) -> Range<usize> {
        self.cross_axis.as_ref().map_or(0..0, Spanned::span)
    }
}

/// Those of one taxel.
pub(super) struct OwnShear<'a> {
    pub(super) baseline: Option<&'a Spanned<[f64; 2]>>,
    pub(super) gain: Option<&'a Spanned<Gains>>,
    pub(super) raw_range: Option<&'a Spanned<[f64; 2]>>,
    pub(super) noise: Option<&'a Spanned<Value>>,
}

impl OwnShear<'_> {
    /// Puts them into `shear`, of the body's taxel `taxel`.
    pub(super) fn read(&self, taxel: usize, shear: &mut ShearCalibration, text: Text<'_>) -> Result<()> {
        if let Some(baselines) = self.baseline {
            shear.own_baselines.insert(taxel, baselines_of("shear_baseline", baselines, text)?);
        }
        if let Some(gains) = self.gain {
            shear.own_gains.insert(taxel, gains_of("shear_gain", gains, text)?);
        }
        if let Some(range) = self.raw_range {
            shear.own_raw_ranges.insert(taxel, range_of("shear_raw_range", range, text)?);
        }
        if let Some(noise) = self.noise {
            shear.own_noises.insert(taxel, noise_of("shear_noise", noise, text)?);
        }
        Ok(())
    }
}

/// Multiplies the gains of `shear` by `scale`, which stands at a place of `text`.
pub(super) fn scale(shear: &mut ShearCalibration, scale: (f64, usize), text: Text<'_>) -> Result<()> {
    for gain in shear.gain.iter_mut().chain(shear.own_gains.values_mut()).flatten() {
        *gain = scaled(*gain, scale, text)?;
    }
    Ok(())
}

/// `gain` times the scale that stands `at` a place of `text`.
pub(super) fn scaled(gain: f64, (scale, at): (f64, usize), text: Text<'_>) -> Result<f64> {
    let product = gain * scale;
    if GAIN_RANGE.contains(&product.abs()) {
        return Ok(product);
    }
    let what = format!("`scale` makes a gain {:e}; gains must be between 1e-12 and 1e12", product.abs());
    Err(text.wrong(at..at, what))
}

fn gains_of(key: &str, gains: &Spanned<Gains>, text: Text<'_>) -> Result<[f64; 2]> {
    let Gains(both) = *gains.get_ref();
    both.iter().try_for_each(|&gain| gain_of(key, &Spanned::new(gains.span(), gain), text).map(|_| ()))?;
    Ok(both)
}

/// A standard deviation of raw values, of u and v alike.
fn noise_of(key: &str, noise: &Spanned<Value>, text: Text<'_>) -> Result<f64> {
    let number = match noise.get_ref() {
        Value::Float(number) => *number,
        Value::Integer(number) => *number as f64,
        other => {
            let kind = if other.is_array() { "list" } else { other.type_str() };
            let what = format!("`{key}` is a {kind}; give one number of raw units, which holds for u and v alike");
            return Err(text.wrong(noise.span(), what));
        }
    };
    if (0.0..=MAX_MAGNITUDE).contains(&number) {
        return Ok(number);
    }
    Err(text.wrong(noise.span(), format!("`{key}` is {number}; it must be 0 or more raw units")))
}

fn baselines_of(key: &str, baselines: &Spanned<[f64; 2]>, text: Text<'_>) -> Result<[f64; 2]> {
    let both = *baselines.get_ref();
    if both.iter().all(|raw| raw.abs() <= MAX_MAGNITUDE) {
        return Ok(both);
    }
    Err(text.wrong(baselines.span(), format!("`{key}` is {both:?}; it must be two finite numbers of raw units")))
}

/// [`ShearCalibration::into_normal`] and [`ShearCalibration::cross_axis`].
fn rows_of(matrix: &Spanned<Matrix>, text: Text<'_>) -> Result<([f64; 3], [[f64; 3]; 2])> {
    let Matrix([n, u, v]) = *matrix.get_ref();
    let sides = [u, v];
    let why = if let Some(share) = [n, u, v].iter().flatten().find(|share| share.is_nan() || share.abs() > MOST_ACROSS)
    {
        format!("has {share}; its numbers are at most {MOST_ACROSS} in size")
    } else if sides.iter().flatten().all(|share| *share == 0.0) {
        "leaves no shear; its rows are all 0".into()
    } else if n[0] < 1.0 / MOST_ACROSS {
        format!("has {} of the normal force in itself; that is about 1, and over 0", n[0])
    } else {
        // u = d·N + e·u + f·v, where P = a·N + b·u + c·v has N in it: N = (P − b·u − c·v)/a.
        let of_p = sides.map(|[d, e, f]| [d / n[0], e - d * n[1] / n[0], f - d * n[2] / n[0]]);
        return Ok((n, of_p));
    };
    let what = format!("`cross_axis` {why}: give a row each of u and v, or of n, u and v, of shares of n, u and v");
    Err(text.wrong(matrix.span(), what))
}

#[cfg(test)]
mod tests {
    use crate::keys::without_column;
    use crate::signal::{Calibration, Response};

    fn read(text: &str) -> Result<Calibration, String> {
        Calibration::parse(text, &[3, 7]).map_err(|e| without_column(&e.to_string()))
    }

    fn why(text: &str) -> String {
        read(text).unwrap_err()
    }

    #[test]
    fn tangential_forces_have_baselines_gains_and_what_the_axes_share() {
        let text = "[all]\nunit = \"N\"\n[shear]\nbaseline = [10, -10]\ngain = 0.01\ncross_axis = [[0.1, 1, 0], [0, 0, 1]]\nslips_at = 0.6\n\
                    raw_range = [-5, 5]\n[taxel.7]\nshear_baseline = [1, 2]\nshear_gain = [0.02, 3]\nshear_raw_range = [0, 9]\n";
        let shear = read(text).unwrap().shear;
        assert_eq!((shear.baselines, shear.cross_axis[0], shear.slips_at), ([10.0, -10.0], [0.1, 1.0, 0.0], Some(0.6)));
        assert_eq!((shear.rest_of(0), shear.rest_of(1)), ([10.0, -10.0], [1.0, 2.0]));
        assert_eq!((shear.gains_of(0, -9.0, 1.0), shear.gains_of(1, -9.0, 10.0)), ([0.01; 2], [0.2, 30.0]));
        assert_eq!((shear.range_of(0), shear.range_of(1)), ([-5.0, 5.0], [0.0, 9.0]));
        assert!(!shear.leaks_into_normal());
        let apart = read("[shear]\ngain = [2, -3]\n").unwrap().shear;
        assert_eq!(apart.forces([1.0, 1.0], apart.gains_of(0, 1.0, 1.0), 5.0, [4.0, 3.0]), [6.0, -6.0]);
        assert_eq!(read("").unwrap().shear.gains_of(0, -9.0, 1.0), [9.0; 2]);
    }

    #[test]
    fn a_scale_multiplies_gains_along_the_skin_too() {
        let gains = |scale: &str| {
            let text =
                format!("[all]\n{scale}gain = 3\nunit = \"kPa\"\n[shear]\ngain = [2, 5]\n[taxel.7]\nshear_gain = 7\n");
            let read = read(&text).unwrap();
            [0, 1].map(|taxel| {
                let own = &read.taxels[taxel];
                let [u, v] = read.shear.gains_of(taxel, own.gain, own.unit_factor);
                [own.gain, u, v]
            })
        };
        let (before, after) = (gains(""), gains("scale = 0.5\n"));
        assert_eq!(before, [[3000.0, 2000.0, 5000.0], [3000.0, 7000.0, 7000.0]]);
        assert_eq!(after, before.map(|of_taxel| of_taxel.map(|gain| 0.5 * gain)));
        assert_eq!(
            why("[all]\nscale = 1e-6\n[shear]\ngain = [1, 1e-10]"),
            "line 2: `scale` makes a gain 1e-16; gains must be between 1e-12 and 1e12"
        );
    }

    #[test]
    fn a_third_row_takes_what_is_along_the_skin_out_of_the_normal_force() {
        let shear = read("[shear]\ncross_axis = [[2, 0.5, 0], [0.4, 1, 0], [0, 0, 1]]\n").unwrap().shear;
        // N = 3, u = 4: P = 8 and s = [5.2, 1].
        assert_eq!((shear.into_normal, shear.leaks_into_normal()), ([2.0, 0.5, 0.0], true));
        let [u, v] = shear.forces([0.0; 2], [1.0; 2], 8.0, [4.0, 1.0]);
        assert!((u - 5.2).abs() < 1e-12 && v == 1.0, "{u} {v}");
        let alone = read("[shear]\ncross_axis = [[1, 0, 0], [0.4, 1, 0], [0, 0, 1]]\n").unwrap().shear;
        assert_eq!(alone, read("[shear]\ncross_axis = [[0.4, 1, 0], [0, 0, 1]]\n").unwrap().shear);
    }

    #[test]
    fn what_makes_no_sense_is_said_with_its_line() {
        let rows = "give a row each of u and v, or of n, u and v, of shares of n, u and v";
        for (wrong, why_not) in [
            ("[[1, nan, 0], [0, 0, 1]]", "has NaN; its numbers are at most 1000000 in size"),
            ("[[1e8, 1, 1], [0, 0, 1]]", "has 100000000; its numbers are at most 1000000 in size"),
            ("[[0, 0, 0], [0, 0, 0]]", "leaves no shear; its rows are all 0"),
            ("[[1, 0, 0], [0, 0, 0], [0, 0, 0]]", "leaves no shear; its rows are all 0"),
            ("[[0, 1, 0], [0, 1, 0], [0, 0, 1]]", "has 0 of the normal force in itself; that is about 1, and over 0"),
        ] {
            let is = why(&format!("[shear]\ncross_axis = {wrong}"));
            assert_eq!(is, format!("line 2: `cross_axis` {why_not}: {rows}"));
        }
        assert!(why("[shear]\nnoise = -1").starts_with("line 2: `noise` is -1; it must be 0 or more raw units"));
        assert!(why("[taxel.7]\nshear_noise = nan").starts_with("line 2: `shear_noise` is NaN"));
        let one = "give one number of raw units, which holds for u and v alike";
        assert_eq!(why("[shear]\nnoise = [1, 2]"), format!("line 2: `noise` is a list; {one}"));
        assert_eq!(why("[taxel.7]\nshear_noise = \"low\""), format!("line 2: `shear_noise` is a string; {one}"));
        assert!(why("[shear]\nslips_at = 0").starts_with("line 2: `slips_at` is 0"));
        assert!(why("[shear]\ngain = [1, 0]").starts_with("line 2: `gain` is 0; it must be between"));
        assert_eq!(why("[shear]\ngain = \"much\""), "line 2: expected a number, or a list of two: of u and of v");
        assert_eq!(
            why("[shear]\nraw_range = [5, 5]"),
            "line 2: `raw_range` is [5, 5]; give the lowest and the highest raw value"
        );
        assert!(why("[taxel.7]\nshear_raw_range = [0, nan]").starts_with("line 2: `shear_raw_range` is [0, NaN]"));
        for text in [
            "[shear]\nbaseline = [0, 0, 0]",
            "[shear]\ngain = [1, 1, 1]",
            "[shear]\nraw_range = [1]",
            "[shear]\ncross_axis = [[0, 1, 0, 9], [0, 0, 1]]",
            "[shear]\ncross_axis = [[0, 1, 0]]",
            "[shear]\ncross_axis = [[0, 1, 0], [0, 0, 1], [0, 0, 0], [0, 0, 0]]",
            "[taxel.3]\nshear_baseline = [0, 0, 4]",
            "[taxel.3]\nshear_gain = [3]",
        ] {
            let why = why(text);
            assert!(why.starts_with("line 2: a list has ") && why.contains("here; give it "), "{text}: {why}");
        }
    }

    #[test]
    fn normal_forces_by_a_curve_are_not_corrected() {
        let curve = "[curve.a]\nraw = [0, 10]\np = [0, 4]\n[shear]\ngain = 1\ncross_axis = [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]\n";
        let text = format!("{curve}[taxel.7]\ncurve = \"a\"\n");
        let kinds = |three| [(3, crate::body::Modality::Force3), (7, three)];
        let for_kinds =
            |three| Calibration::parse_for(&text, &kinds(three)).map_err(|e| without_column(&e.to_string()));
        assert_eq!(
            for_kinds(crate::body::Modality::Force3).unwrap_err(),
            "line 6: `cross_axis` in [shear] corrects normal forces, which taxel 7 has by a curve or as an FSR; give two rows"
        );
        let of_one_axis = for_kinds(crate::body::Modality::Pressure).unwrap();
        assert_eq!(of_one_axis.taxels[1].response, Response::Curve(0));
        // Without a body it is not known which have three axes.
        assert!(read(&text).is_ok());
    }

    #[test]
    fn the_noise_of_tangential_values_is_their_own_where_it_is_given() {
        let of = |text: &str| {
            let shear = read(text).unwrap().shear;
            [0, 1].map(|taxel| shear.noise_of(taxel))
        };
        assert_eq!(of("[all]\nnoise = 2"), [None, None]);
        assert_eq!(of("[shear]\nnoise = 3\n[taxel.7]\nshear_noise = 0"), [Some(3.0), Some(0.0)]);
        assert_eq!(of("[taxel.3]\nshear_noise = 1.5"), [Some(1.5), None]);
    }
}
