//! The curves that a plan's taxels need, each once, as the backends read them.

use std::collections::HashMap;

use super::onset::SoftOnset;
use crate::error::Result;
use crate::signal::{Calibration, Curve, FsrSignal, Response, TaxelCalibration, slope};
use crate::stage::calibrate::Table;
use crate::stage::layout;

#[derive(Clone, Debug, Default)]
pub(crate) struct Curves {
    pub(crate) curves: Vec<layout::Curve>,
    pub(crate) knots: Vec<layout::Knot>,
    /// The knots as the calibration has them, (raw, P).
    written: Vec<[f64; 2]>,
    /// Taxels that respond alike share a curve.
    known: HashMap<Alike, u32>,
}

/// What makes a taxel's curve: its kind or number, then whatever else there is, as bits.
type Alike = (usize, u8, u64, u64, u64);

impl Curves {
    /// What [`layout::Taxel::response`] says for `taxel`, whose soft onset, if it has one, is `onset`.
    pub(super) fn response_of(
        &mut self,
        calibration: &Calibration,
        taxel: &TaxelCalibration,
        signal: Option<FsrSignal>,
        onset: SoftOnset,
    ) -> Result<u32> {
        let (gain, threshold) = (taxel.gain.to_bits(), onset.threshold.to_bits());
        let alike = match taxel.response {
            _ if taxel.mask => return Ok(layout::MASKED),
            Response::Linear => return Ok(layout::STRAIGHT),
            Response::Fsr(fsr) => {
                let kind = usize::from(signal.unwrap_or(fsr.signal) == FsrSignal::Linear);
                (kind, fsr.wiper, fsr.full_scale_newton.to_bits(), gain, threshold)
            }
            Response::Curve(index) => (2 + index, 0, 0, gain, threshold),
        };
        if let Some(&known) = self.known.get(&alike) {
            return Ok(known);
        }
        let response = layout::FIRST_CURVE + self.curves.len() as u32;
        if let Some(curve) = calibration.curve_of(taxel, signal)? {
            self.add(&if onset.threshold > 0.0 { curve.lowered(onset.threshold) } else { curve });
        }
        self.known.insert(alike, response);
        Ok(response)
    }

    fn add(&mut self, curve: &Curve) {
        let knots = curve.knots();
        self.curves.push(layout::Curve { first: self.knots.len() as u32, count: knots.len() as u32 });
        let slopes = knots.windows(2).map(|pair| slope(pair[0], pair[1]) as f32).chain([0.0]);
        self.written.extend_from_slice(curve.written());
        self.knots.extend(knots.iter().zip(slopes).map(|(&[raw, p], slope)| layout::Knot { raw, p, slope }));
    }

    /// The curve of a taxel that responds by `response`; without knots for a straight line.
    pub(crate) fn table(&self, response: u32) -> Table<'_> {
        let index = response.checked_sub(layout::FIRST_CURVE).map(|index| index as usize);
        let Some(curve) = index.map(|index| self.curves[index]) else { return Table::default() };
        let range = curve.first as usize..(curve.first + curve.count) as usize;
        Table { written: &self.written[range.clone()], rounded: &self.knots[range] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn taxels_that_respond_alike_share_a_curve() {
        let text = "[curve.a]\nraw = [0, 2]\np = [0, 8]\n[all]\nsensor = \"fsr\"\n[taxel.1]\nwiper = 7\n[taxel.2]\n\
                    curve = \"a\"\n[taxel.3]\ncurve = \"a\"\ninvert = true\n[taxel.4]\nwiper = 7\n[taxel.5]\nmask = true\n\
                    [taxel.6]\nsensor = \"linear\"";
        let calibration = Calibration::parse(text, &[0, 1, 2, 3, 4, 5, 6]).unwrap();
        let mut curves = Curves::default();
        let response = |curves: &mut Curves, taxel: &TaxelCalibration, signal| {
            curves.response_of(&calibration, taxel, signal, SoftOnset::default()).unwrap()
        };
        let codes: Vec<u32> = calibration.taxels.iter().map(|taxel| response(&mut curves, taxel, None)).collect();
        assert_eq!(codes, [2, 3, 4, 5, 3, layout::MASKED, layout::STRAIGHT]);
        assert_eq!((curves.curves.len(), curves.knots.len()), (4, 2 * 1024 + 4));
        assert_eq!(curves.table(4).rounded[0], layout::Knot { raw: 0.0, p: 0.0, slope: 4.0 });
        assert_eq!(curves.table(5).rounded.iter().map(|knot| knot.raw).collect::<Vec<_>>(), [-2.0, 0.0]);
        assert!([layout::STRAIGHT, layout::MASKED].iter().all(|&response| curves.table(response).written.is_empty()));
        // The other signal is another curve.
        assert_eq!(response(&mut curves, &calibration.taxels[0], Some(FsrSignal::Raw)), 6);
        assert_eq!(curves.table(6).rounded[500].p, crate::signal::FsrCircuit::default().logarithmic(500) as f32);
    }
}
