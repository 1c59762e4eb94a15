//! Converts the force on a taxel to a raw value: circuit, noise, drift and faults.

use super::noise;
use crate::signal::FsrCircuit;

/// The output of an `fsr` sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum FsrOutput {
    /// The converter's reading, which falls when pressed.
    Counts,
    /// The paper's logarithmic raw signal, 0 to 1000.
    Logarithmic,
    /// The paper's linearised signal, 0 to 1000 at this force.
    Linearised { full_scale_newton: f64 },
}

/// The conversion of a force to a raw value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// The force itself, N.
    Ideal,
    /// The paper's circuit.
    Fsr { circuit: FsrCircuit, output: FsrOutput },
    /// offset + gain · force, rounded and cut to whole counts where it has `bits`.
    Linear { offset: f64, gain: f64, bits: Option<u32> },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fault {
    /// It always reads as if untouched.
    Dead,
    /// It always reads this.
    Stuck(f64),
    /// Its noise has this standard deviation.
    Noisy(f64),
}

/// The sensors of a simulation, equal except for gains and faults.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sensor {
    pub(super) kind: Kind,
    pub(super) seed: u64,
    /// Standard deviation before rounding, in counts (an ideal sensor's: N).
    pub(super) noise_sigma: f64,
    /// Drift of all readings per minute, in the same unit.
    pub(super) drift_per_minute: f64,
    /// By taxel, the factor on its force.
    pub(super) gains: Vec<f64>,
    /// Forces up to this one, after the gain, are not felt.
    pub(super) threshold_newton: f64,
    /// A dead band of the calibration in place of the one that fits.
    pub(super) dead_band: Option<f64>,
    pub(super) faults: Vec<Option<Fault>>,
}

/// Forces under this size, N, are tails of footprints: sensors read them as 0. The engine flags values under 2⁻⁶⁰ as faulty.
const LEAST_NEWTON: f64 = 1.0 / (1_u64 << 50) as f64;

/// A taxel in a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reading {
    /// Index in the order of the source.
    pub(super) index: usize,
    pub(super) id: u32,
    pub(super) frame: u64,
    pub(super) t_s: f64,
    pub(super) force_newton: f64,
}

impl Sensor {
    pub(super) fn read(&self, reading: &Reading) -> f64 {
        let disturbed = match self.disturbed(reading) {
            Ok(disturbed) => disturbed,
            Err(stuck) => return stuck.unwrap_or_else(|| self.kind.value(0.0, 0.0)),
        };
        let force_newton = self.gains[reading.index] * reading.force_newton;
        let felt = if force_newton > self.threshold_newton { without_tail(force_newton) } else { 0.0 };
        self.kind.value(felt, disturbed)
    }

    /// The same of a tangential force, which has no threshold.
    pub(super) fn read_pull(&self, reading: &Reading) -> f64 {
        match self.disturbed(reading) {
            Ok(disturbed) => self.kind.pull(without_tail(self.gains[reading.index] * reading.force_newton), disturbed),
            Err(stuck) => stuck.unwrap_or_else(|| self.kind.pull(0.0, 0.0)),
        }
    }

    /// What noise and drift add; or, of a broken taxel that feels nothing, what it reads, `None` if that is as untouched.
    fn disturbed(&self, reading: &Reading) -> Result<f64, Option<f64>> {
        let sigma = match self.faults[reading.index] {
            Some(Fault::Dead) => return Err(None),
            Some(Fault::Stuck(value)) => return Err(Some(value)),
            Some(Fault::Noisy(sigma)) => sigma,
            None => self.noise_sigma,
        };
        let noise = if sigma > 0.0 { sigma * noise::normal(self.seed, reading.frame, reading.id) } else { 0.0 };
        Ok(noise + self.drift_per_minute * (reading.t_s / 60.0))
    }
}

impl Kind {
    /// The raw value at `force_newton` with `disturbed` counts added before the converter.
    fn value(&self, force_newton: f64, disturbed: f64) -> f64 {
        match *self {
            Self::Ideal => force_newton + disturbed,
            Self::Fsr { circuit, output } => {
                let counts = FsrCircuit::convert(circuit.level(force_newton) + disturbed);
                match output {
                    FsrOutput::Counts => counts.into(),
                    FsrOutput::Logarithmic => circuit.logarithmic(counts),
                    FsrOutput::Linearised { full_scale_newton } => circuit.linearised(counts, full_scale_newton),
                }
            }
            Self::Linear { offset, gain, bits } => converted(offset + gain * force_newton + disturbed, bits),
        }
    }

    /// The raw value at the tangential force `force_newton`. An `fsr` feels none.
    fn pull(&self, force_newton: f64, disturbed: f64) -> f64 {
        match *self {
            Self::Ideal | Self::Fsr { .. } => force_newton + disturbed,
            Self::Linear { gain, bits, .. } => {
                converted(self.pull_at_rest() + gain.abs() * force_newton + disturbed, bits)
            }
        }
    }

    /// What tangential channels read without a force: counts have room for both signs.
    pub(super) fn pull_at_rest(&self) -> f64 {
        match *self {
            Self::Linear { bits: Some(bits), .. } => f64::from(1_u32 << (bits - 1)),
            Self::Linear { offset, .. } => offset,
            Self::Ideal | Self::Fsr { .. } => 0.0,
        }
    }
}

/// `force_newton`, or 0 where it is but a footprint's tail.
fn without_tail(force_newton: f64) -> f64 {
    if force_newton.abs() < LEAST_NEWTON { 0.0 } else { force_newton }
}

/// `level` as a converter with `bits` gives it. Halves round up.
fn converted(level: f64, bits: Option<u32>) -> f64 {
    bits.map_or(level, |bits| (level + 0.5).floor().clamp(0.0, f64::from((1_u32 << bits) - 1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensor(kind: Kind, faults: Vec<Option<Fault>>) -> Sensor {
        Sensor {
            kind,
            seed: 1,
            noise_sigma: 0.0,
            drift_per_minute: 0.0,
            gains: vec![1.0; faults.len()],
            threshold_newton: 0.0,
            dead_band: None,
            faults,
        }
    }

    fn reading(index: usize, force_newton: f64) -> Reading {
        Reading { index, id: 7, frame: 3, t_s: 30.0, force_newton }
    }

    #[test]
    fn a_linear_sensor_rounds_and_stays_in_range() {
        let inverted = Kind::Linear { offset: 240.0, gain: -20.0, bits: Some(8) };
        let sensor = sensor(inverted, vec![None]);
        assert_eq!([0.0, 1.02, 1.03, 100.0].map(|f| sensor.read(&reading(0, f))), [240.0, 220.0, 219.0, 0.0]);
        let drifting = Sensor { drift_per_minute: 60.0, ..sensor };
        assert_eq!([0.0, 1.0].map(|f| drifting.read(&reading(0, f))), [255.0, 250.0]);
    }

    #[test]
    fn a_gain_scales_the_force_and_a_threshold_hides_it() {
        let sensor = Sensor { gains: vec![1.0, 1.5], threshold_newton: 2.0, ..sensor(Kind::Ideal, vec![None; 2]) };
        assert_eq!([1.0, 2.0, 2.5].map(|f| sensor.read(&reading(0, f))), [0.0, 0.0, 2.5]);
        assert_eq!([1.0, 2.0, 2.5].map(|f| sensor.read(&reading(1, f))), [0.0, 3.0, 3.75]);
    }

    #[test]
    fn a_footprints_tail_reads_zero() {
        let ideal = sensor(Kind::Ideal, vec![None]);
        let unrounded = sensor(Kind::Linear { offset: 0.0, gain: 1e-3, bits: None }, vec![None]);
        for tail in [3.2e-23, -3.2e-23, 8e-16] {
            assert_eq!([ideal.read_pull(&reading(0, tail)), unrounded.read_pull(&reading(0, tail))], [0.0; 2]);
            assert_eq!([ideal.read(&reading(0, tail.abs())), unrounded.read(&reading(0, tail.abs()))], [0.0; 2]);
        }
        assert_eq!([ideal.read(&reading(0, 1e-12)), ideal.read_pull(&reading(0, -1e-12))], [1e-12, -1e-12]);
    }

    #[test]
    fn a_tangential_force_has_two_signs_and_is_never_inverted() {
        let inverted = Kind::Linear { offset: 240.0, gain: -20.0, bits: Some(8) };
        let counts = sensor(inverted, vec![None, Some(Fault::Dead), Some(Fault::Stuck(7.0))]);
        assert_eq!(
            [-9.0, -1.0, 0.0, 1.0, 9.0].map(|f| counts.read_pull(&reading(0, f))),
            [0.0, 108.0, 128.0, 148.0, 255.0]
        );
        assert_eq!([1, 2].map(|taxel| counts.read_pull(&reading(taxel, 1.0))), [128.0, 7.0]);
        let plain =
            Sensor { threshold_newton: 3.0, ..sensor(Kind::Linear { offset: 5.0, gain: 2.0, bits: None }, vec![None]) };
        assert_eq!([-1.0, 2.0].map(|f| plain.read_pull(&reading(0, f))), [3.0, 9.0]);
    }

    #[test]
    fn broken_taxels_read_what_they_must() {
        let faults = vec![Some(Fault::Dead), Some(Fault::Stuck(700.0)), Some(Fault::Noisy(50.0)), None];
        let fsr = Kind::Fsr { circuit: FsrCircuit::default(), output: FsrOutput::Counts };
        let sensor = Sensor { noise_sigma: 3.0, ..sensor(fsr, faults) };
        let spread = |index: usize| {
            let values = (0..200).map(|frame| sensor.read(&Reading { frame, ..reading(index, 1.0) }));
            let (low, high) = values.fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)));
            (low, high)
        };
        assert_eq!(spread(0), (1023.0, 1023.0));
        assert_eq!(spread(1), (700.0, 700.0));
        let width = |(low, high): (f64, f64)| high - low;
        assert!(width(spread(2)) > 10.0 * width(spread(3)) && width(spread(3)) > 3.0);
    }

    #[test]
    fn the_papers_signals_come_from_the_whole_count() {
        let circuit = FsrCircuit::default();
        let counts = circuit.counts(2.0);
        let signals = [FsrOutput::Counts, FsrOutput::Logarithmic, FsrOutput::Linearised { full_scale_newton: 5.0 }]
            .map(|output| {
                let sensor = sensor(Kind::Fsr { circuit, output }, vec![None]);
                sensor.read(&reading(0, 2.0))
            });
        assert_eq!(signals, [counts.into(), circuit.logarithmic(counts), circuit.linearised(counts, 5.0)]);
    }
}
