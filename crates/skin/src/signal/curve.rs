//! Curves: non-linear conversions from raw value to pressure.

use std::cmp::Ordering;

use super::fsr::FsrCircuit;
use super::response::{FsrResponse, FsrSignal, GAIN_RANGE, MAX_MAGNITUDE};
use crate::error::{Error, Result, failed};

/// A monotone table from raw value to pressure: linear between its knots, constant beyond its ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// (raw, P); raw strictly increasing, P monotone.
    knots: Vec<[f32; 2]>,
    /// The same in double precision.
    written: Vec<[f64; 2]>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Column {
    Raw,
    P,
}

#[derive(Debug)]
pub struct CurveError {
    pub column: Column,
    /// The knot, from 0; beyond the last for an error of the whole column.
    pub knot: usize,
    pub what: String,
}

impl Curve {
    /// The curve through the knots (`raw[i]`, `p[i]`), in single precision.
    ///
    /// # Errors
    /// Fewer than two knots, different numbers of raw values and pressures, a number that is not finite or not credible, raw
    /// values that do not rise, pressures that are not monotone or all equal, or a slope out of single precision.
    pub fn new(raw: &[f64], p: &[f64]) -> Result<Self> {
        Self::checked(raw, p).map_err(|error| Error::failed(error.what))
    }

    /// The same, with the place of the error.
    #[doc(hidden)]
    pub fn checked(raw: &[f64], p: &[f64]) -> std::result::Result<Self, CurveError> {
        let int = |column, what| Err(CurveError { column, knot: usize::MAX, what });
        let (knots, pressures) = (raw.len(), p.len());
        if knots != pressures {
            let what = format!("`raw` has {knots} knots and `p` has {pressures}; give as many of one as of the other");
            return int(Column::P, what);
        }
        if knots < 2 {
            return int(Column::Raw, format!("`raw` has {knots} of the two knots that a curve has at least"));
        }
        for (column, name, values) in [(Column::Raw, "raw", raw), (Column::P, "p", p)] {
            if let Some((knot, x)) = values.iter().enumerate().find(|(_, x)| !is_credible(**x)) {
                let at = knot + 1;
                let what = format!("`{name}` is {x} at knot {at}; it must be 0, or between 1e-18 and 1e18 in size");
                return Err(CurveError { column, knot, what });
            }
        }
        let curve = Self::through(raw.iter().zip(p).map(|(&raw, &p)| [raw, p]).collect());
        let falls = curve.falls();
        for (knot, pair) in curve.knots.windows(2).enumerate() {
            let ([from, low], [to, high]) = (pair[0], pair[1]);
            let (knot, at) = (knot + 1, knot + 2);
            if to <= from {
                let what = format!(
                    "`raw` is {} at knot {at}, after {from} in single precision; it must rise from knot to knot",
                    raw[knot]
                );
                return Err(CurveError { column: Column::Raw, knot, what });
            }
            if (falls && high > low) || (!falls && high < low) {
                let what = format!(
                    "`p` is {high} at knot {at}, after {low}: it is not monotone; it must rise all the way, or fall all \
                     the way"
                );
                return Err(CurveError { column: Column::P, knot, what });
            }
        }
        if curve.knots[0][1] == curve.knots[knots - 1][1] {
            return int(Column::P, format!("`p` is {} at every knot, so that no touch could be felt", p[0]));
        }
        match curve.steep() {
            None => Ok(curve),
            Some((knot, slope)) => {
                let at = knot + 1;
                let what = format!("`p` changes by {slope:e} a raw unit after knot {at}; keep it {GAIN_RANGE_TEXT}");
                Err(CurveError { column: Column::P, knot, what })
            }
        }
    }

    /// The curve of a sensor in the paper's circuit, with a knot at every reading.
    #[doc(hidden)]
    pub fn fsr(sensor: &FsrResponse) -> Self {
        let circuit = FsrCircuit { wiper: sensor.wiper };
        let signal = |counts| match sensor.signal {
            FsrSignal::Raw => circuit.logarithmic(counts),
            FsrSignal::Linear => circuit.linearised(counts, sensor.full_scale_newton),
        };
        Self::through((0..=FsrCircuit::OPEN_COUNTS).map(|n| [f64::from(n), signal(n)]).collect())
    }

    fn through(written: Vec<[f64; 2]>) -> Self {
        Self { knots: written.iter().map(|knot| knot.map(|x| x as f32)).collect(), written }
    }

    /// The curve for P = |gain| · curve(±x), with the sign of `gain`; an error if a slope would leave single precision.
    #[doc(hidden)]
    pub fn scaled(&self, gain: f64) -> Result<Self> {
        let single = gain.abs() as f32;
        let mut knots: Vec<[f32; 2]> = self.knots.iter().map(|&[raw, p]| [raw, p * single]).collect();
        let mut written: Vec<[f64; 2]> = self.written.iter().map(|&[raw, p]| [raw, p * gain.abs()]).collect();
        if gain < 0.0 {
            knots.reverse();
            knots.iter_mut().for_each(|[raw, _]| *raw = -*raw);
            written.reverse();
            written.iter_mut().for_each(|[raw, _]| *raw = -*raw);
        }
        let scaled = Self { knots, written };
        match scaled.steep() {
            None => Ok(scaled),
            Some((_, slope)) => Err(failed!(
                "`gain` {} makes the curve change by {slope:e} a raw unit; keep it {GAIN_RANGE_TEXT}",
                gain.abs()
            )),
        }
    }

    /// The same with P less by `threshold`, and so below 0 for what is not felt.
    #[doc(hidden)]
    pub fn lowered(&self, threshold: f64) -> Self {
        Self::through(self.written.iter().map(|&[raw, p]| [raw, p - threshold]).collect())
    }

    /// The curve at `raw` in double precision.
    pub(super) fn value(&self, raw: f64) -> f64 {
        let after = self.written.partition_point(|knot| knot[0] <= raw);
        let [start, low] = self.written[after.saturating_sub(1)];
        match self.written.get(after) {
            Some(&[end, high]) if after > 0 => low + (high - low) * ((raw - start) / (end - start)),
            _ => low,
        }
    }

    /// Whether `raw`, which may be `off` by so much, lies beyond the end of the curve where the values are least (`Less`) or greatest
    /// (`Greater`), or neither.
    pub(super) fn end_beyond(&self, raw: f64, off: f64) -> Ordering {
        let [first, last] = [self.written[0], self.written[self.written.len() - 1]].map(|[raw, _]| raw);
        match (raw + off < first, raw - off > last) {
            (false, false) => Ordering::Equal,
            (is_before, _) if is_before == self.falls() => Ordering::Greater,
            _ => Ordering::Less,
        }
    }

    /// (raw, P) of every knot, raw rising, in single precision.
    #[must_use]
    pub fn knots(&self) -> &[[f32; 2]] {
        &self.knots
    }

    /// (raw, P) of every knot, raw rising, as it is written.
    #[doc(hidden)]
    pub fn written(&self) -> &[[f64; 2]] {
        &self.written
    }

    /// Whether the raw value falls when the sensor is pressed.
    #[must_use]
    pub fn falls(&self) -> bool {
        self.knots[0][1] > self.knots[self.knots.len() - 1][1]
    }

    /// The distance of the raw value `x` from the curve's untouched end.
    #[doc(hidden)]
    pub fn rise(&self, x: f64) -> f64 {
        if self.falls() { f64::from(self.knots[self.knots.len() - 1][0]) - x } else { x - f64::from(self.knots[0][0]) }
    }

    /// The first knot after which the slope is neither 0 nor within [`GAIN_RANGE`].
    fn steep(&self) -> Option<(usize, f64)> {
        let slopes = self.knots.windows(2).map(|pair| slope(pair[0], pair[1]));
        slopes.enumerate().find(|(_, slope)| *slope != 0.0 && !GAIN_RANGE.contains(&slope.abs()))
    }
}

const GAIN_RANGE_TEXT: &str = "between 1e-12 and 1e12";

/// ΔP / Δraw from one knot to the next.
pub fn slope([from, low]: [f32; 2], [to, high]: [f32; 2]) -> f64 {
    (f64::from(high) - f64::from(low)) / (f64::from(to) - f64::from(from))
}

/// Whether backends accept `x`, see [`MAX_MAGNITUDE`].
fn is_credible(x: f64) -> bool {
    x == 0.0 || (1.0 / MAX_MAGNITUDE..=MAX_MAGNITUDE).contains(&x.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::FsrSignal::{Linear, Raw};

    #[test]
    fn a_table_that_makes_no_sense_is_distinguished() {
        let why = |raw: &[f64], p: &[f64]| Curve::new(raw, p).unwrap_err().to_string();
        assert_eq!(
            why(&[0.0, 1.0, 2.0], &[0.0, 9.0, 8.0]),
            "`p` is 8 at knot 3, after 9: it is not monotone; it must rise all the way, or fall all the way"
        );
        assert!(why(&[0.0, 1.0, 2.0], &[9.0, 9.5, 8.0]).contains("9.5 at knot 2"));
        assert!(why(&[0.0, 1.0], &[0.0, 9.0, 8.0]).contains("`raw` has 2 knots and `p` has 3"));
        assert!(why(&[0.0], &[0.0]).contains("`raw` has 1 of the two knots"));
        assert!(why(&[], &[]).contains("two knots"));
        assert!(why(&[0.0, f64::NAN], &[0.0, 1.0]).contains("`raw` is NaN at knot 2"));
        assert!(why(&[0.0, 1.0], &[f64::INFINITY, 1.0]).contains("`p` is inf at knot 1"));
        assert!(why(&[0.0, 1.0], &[0.0, 1e-30]).contains("between 1e-18"));
        assert!(why(&[0.0, 1.0, 1.0], &[0.0, 1.0, 2.0]).contains("`raw` is 1 at knot 3, after 1 "));
        // Apart in double precision only.
        assert!(why(&[0.0, 16_777_216.0, 16_777_217.0], &[0.0, 1.0, 2.0]).contains("must rise"));
        assert!(why(&[0.0, 1.0], &[3.0, 3.0]).contains("no touch"));
        assert!(why(&[0.0, 0.5_f64.powi(20)], &[0.0, 1e7]).contains("1.048576e13 a raw unit after knot 1"));
        assert!(Curve::new(&[-5.0, 0.0, 1.0], &[3.0, 3.0, -1.0]).unwrap().falls());
    }

    #[test]
    fn beyond_a_curve_it_is_known_which_end_is_near() {
        let ends = |p: [f64; 2]| {
            let curve = Curve::new(&[10.0, 30.0], &p).unwrap();
            [9.9, 10.0, 20.0, 30.0, 30.1].map(|raw| curve.end_beyond(raw, 0.05))
        };
        use Ordering::{Equal, Greater, Less};
        assert_eq!(ends([1.0, 8.0]), [Less, Equal, Equal, Equal, Greater]);
        assert_eq!(ends([8.0, 1.0]), [Greater, Equal, Equal, Equal, Less]);
        assert_eq!(Curve::new(&[10.0, 30.0], &[8.0, 1.0]).unwrap().end_beyond(9.96, 0.05), Equal);
    }

    #[test]
    fn gain_and_inversion_go_into_the_table() {
        let curve = Curve::new(&[0.0, 10.0, 30.0], &[0.0, 1.0, 8.0]).unwrap();
        assert_eq!(curve.scaled(2.0).unwrap().knots(), [[0.0, 0.0], [10.0, 2.0], [30.0, 16.0]]);
        let turned = curve.scaled(-1.0).unwrap();
        assert_eq!(turned.knots(), [[-30.0, 8.0], [-10.0, 1.0], [0.0, 0.0]]);
        assert_eq!((curve.rise(4.0), turned.rise(-4.0)), (4.0, 4.0));
        // As it is written, a gain is not a single-precision number.
        let tenth = curve.scaled(-0.1).unwrap();
        assert_eq!(tenth.written(), [[-30.0, 0.8], [-10.0, 0.1], [0.0, 0.0]]);
        assert_eq!(tenth.knots(), [[-30.0, 0.8], [-10.0, 0.1], [0.0, 0.0]]);
        assert!(curve.scaled(1e12).is_ok() && curve.scaled(1e13).unwrap_err().to_string().contains("`gain`"));
    }

    #[test]
    fn the_circuits_curves_are_sound_tables_that_say_what_it_says() {
        for wiper in 0..=255 {
            for (signal, full_scale_newton) in [(Raw, 10.0), (Linear, 10.0), (Linear, 0.1), (Linear, 1e6)] {
                let curve = Curve::fsr(&FsrResponse { wiper, signal, full_scale_newton });
                let column = |i: usize| curve.knots.iter().map(|knot| f64::from(knot[i])).collect::<Vec<_>>();
                assert_eq!(Curve::new(&column(0), &column(1)).unwrap().knots, curve.knots);
                assert!(curve.falls() && curve.knots[1023] == [1023.0, 0.0]);
                assert_eq!(curve.written[1023], [1023.0, 0.0]);
            }
        }
        let circuit = FsrCircuit { wiper: 100 };
        let curve = Curve::fsr(&FsrResponse { wiper: 100, signal: Linear, full_scale_newton: 5.0 });
        assert_eq!(f64::from(curve.knots[700][1]), f64::from(circuit.linearised(700, 5.0) as f32));
    }
}
