//! The paper's sensor circuit: a force-sensing resistor under a digital potentiometer, read by a 10-bit converter.
//!
//! **Resistor** (Interlink 400, 5 mm). Its resistance falls along a straight line in log-log coordinates, drawn through
//! the typical 30 kΩ at 0.2 N and 1 kΩ at 10 N:
//!
//! R(F) = R₀ (F/F₀)^(−b), R₀ = 30 kΩ, F₀ = 0.2 N, b = ln 30 / ln 50 ≈ 0.869, for F from 0.1 N to 10 N.
//!
//! Below the break force of 0.1 N its layers do not touch and it is open; over 10 N it falls no further. Single
//! resistors are off this line by tens of per cent: the constants are typical, not any one part's.
//!
//! **Divider** (MCP42050). Between supply and junction stands R(wiper) = 50 kΩ · wiper/256 + 52 Ω (the wiper's own), between
//! junction and ground the resistor: V/Vcc = R(F)/(R(F) + R(wiper)). The harder the press, the *lower* the voltage.
//!
//! **Converter**. counts = ⌊1024 · V/Vcc⌋, at most 1023: open reads 1023.
//!
//! **Signals**. The *logarithmic raw* signal is the reading inverted and scaled: 0 open, 1000 at 10 N and over. In
//! between it is about logarithmic in the force, steepest where R(F) = R(wiper). The *linearised* signal is proportional
//! to the force of the reading: 1000 at a full-scale force of the user's choice.

use libm::pow;

/// A point of the log-log line: force, N, and resistance, Ω.
const REFERENCE: (f64, f64) = (0.2, 30_000.0);
/// b = ln 30 / ln 50, from the line's other point, 1 kΩ at 10 N.
const EXPONENT: f64 = 0.869_421_620_717_160_4;

/// The circuit of one sensor, with its potentiometer's wiper at a position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FsrCircuit {
    /// The potentiometer's setting: 0 leaves the wiper's own resistance, 255 nearly all of it.
    pub wiper: u8,
}

impl FsrCircuit {
    /// Below this force the resistor is open, N.
    pub const BREAK_NEWTON: f64 = 0.1;
    /// Above this force the resistance is constant, N.
    pub const SATURATION_NEWTON: f64 = 10.0;
    /// The potentiometer's total resistance, Ω.
    pub const POTENTIOMETER_OHM: f64 = 50_000.0;
    /// The number of positions of its wiper.
    pub const WIPER_POSITIONS: f64 = 256.0;
    /// Its wiper's resistance, Ω.
    pub const WIPER_OHM: f64 = 52.0;
    /// Number of readings the converter has.
    pub const STEPS: f64 = 1024.0;
    /// The reading of an open resistor, which is the highest.
    pub const OPEN_COUNTS: u16 = 1023;
    /// The wiper that puts the steepest part of the response in the middle of the resistor's range.
    pub const MIDDLE_WIPER: u8 = 38;
    /// Full scale of both signals.
    pub const FULL_SIGNAL: f64 = 1000.0;

    /// The resistor's resistance under `force_newton`, Ω; infinite when open, or for NaN.
    #[must_use]
    pub fn resistance_ohm(force_newton: f64) -> f64 {
        if force_newton >= Self::BREAK_NEWTON {
            REFERENCE.1 * pow(force_newton.min(Self::SATURATION_NEWTON) / REFERENCE.0, -EXPONENT)
        } else {
            f64::INFINITY
        }
    }

    /// The resistance above the junction, Ω.
    #[must_use]
    pub fn divider_ohm(self) -> f64 {
        Self::POTENTIOMETER_OHM * f64::from(self.wiper) / Self::WIPER_POSITIONS + Self::WIPER_OHM
    }

    /// The junction's voltage in counts before conversion to an integer: 0..=1024.
    #[must_use]
    pub fn level(self, force_newton: f64) -> f64 {
        let resistance = Self::resistance_ohm(force_newton);
        if resistance.is_infinite() {
            Self::STEPS
        } else {
            Self::STEPS * resistance / (resistance + self.divider_ohm())
        }
    }

    /// The converter's reading for `level`.
    #[must_use]
    pub fn convert(level: f64) -> u16 {
        // `as` makes NaN 0.
        level.floor().clamp(0.0, f64::from(Self::OPEN_COUNTS)) as u16
    }

    /// The reading under `force_newton`.
    #[must_use]
    pub fn counts(self, force_newton: f64) -> u16 {
        Self::convert(self.level(force_newton))
    }

    /// The force at which the junction is at `level`, between the break force and saturation.
    fn newton_at(self, level: f64) -> f64 {
        let resistance = self.divider_ohm() * level / (Self::STEPS - level);
        let force = REFERENCE.0 * pow(resistance / REFERENCE.1, -1.0 / EXPONENT);
        force.clamp(Self::BREAK_NEWTON, Self::SATURATION_NEWTON)
    }

    /// The range of forces that give the reading `counts`, N. Readings that only noise can cause, between open and the break
    /// force or below saturation, get the range there.
    #[must_use]
    pub fn step_newton(self, counts: u16) -> [f64; 2] {
        let counts = counts.min(Self::OPEN_COUNTS);
        let at_break = self.counts(Self::BREAK_NEWTON);
        if counts > at_break {
            return [0.0, Self::BREAK_NEWTON];
        }
        let least = if counts == Self::OPEN_COUNTS { 0.0 } else { self.newton_at(f64::from(counts) + 1.0) };
        let saturated = counts <= self.counts(Self::SATURATION_NEWTON);
        [least, if saturated { f64::INFINITY } else { self.newton_at(f64::from(counts)) }]
    }

    /// The force for the reading `counts`, N: at the middle of its step, 0 when open, 10 N when saturated.
    #[must_use]
    pub fn newton(self, counts: u16) -> f64 {
        let counts = counts.min(Self::OPEN_COUNTS);
        if counts == Self::OPEN_COUNTS || counts > self.counts(Self::BREAK_NEWTON) {
            0.0
        } else if counts <= self.counts(Self::SATURATION_NEWTON) {
            Self::SATURATION_NEWTON
        } else {
            self.newton_at(f64::from(counts) + 0.5)
        }
    }

    /// The paper's logarithmic raw signal, 0..=1000.
    #[must_use]
    pub fn logarithmic(self, counts: u16) -> f64 {
        let pressed = |counts: u16| f64::from(Self::OPEN_COUNTS.saturating_sub(counts));
        let full = pressed(self.counts(Self::SATURATION_NEWTON));
        (Self::FULL_SIGNAL * pressed(counts) / full).min(Self::FULL_SIGNAL)
    }

    /// The paper's linearised signal, 0..=1000, which reaches 1000 at `full_scale_newton` (over 0).
    #[must_use]
    pub fn linearised(self, counts: u16, full_scale_newton: f64) -> f64 {
        (Self::FULL_SIGNAL * self.newton(counts) / full_scale_newton).min(Self::FULL_SIGNAL)
    }
}

impl Default for FsrCircuit {
    fn default() -> Self {
        Self { wiper: Self::MIDDLE_WIPER }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn backward_undoes_forward_within_the_step(wiper: u8, log_force in -9.0..4.6_f64) {
            let force = libm::exp(log_force);
            let circuit = FsrCircuit { wiper };
            let counts = circuit.counts(force);
            let [least, greatest] = circuit.step_newton(counts);
            // The power and its inverse each round once or twice.
            let rounding = 1e-12 * force;
            prop_assert!(least - rounding <= force && force <= greatest + rounding, "{least} {force} {greatest}");
            let back = circuit.newton(counts);
            prop_assert!(least <= back && back <= greatest);
            prop_assert!((back - force).abs() <= greatest - least + rounding);
        }

        #[test]
        fn harder_reads_lower_and_never_higher(wiper: u8, a in 0.0..30.0_f64, b in 0.0..30.0_f64) {
            let (soft, hard) = (a.min(b), a.max(b));
            let circuit = FsrCircuit { wiper };
            prop_assert!(circuit.counts(hard) <= circuit.counts(soft));
            prop_assert!(circuit.level(hard) <= circuit.level(soft));
        }

        #[test]
        fn both_signals_rise_with_pressure_from_0_to_1000(wiper: u8, low in 0..1023_u16) {
            let circuit = FsrCircuit { wiper };
            for signal in [FsrCircuit::logarithmic, |c: FsrCircuit, n: u16| c.linearised(n, 10.0)] {
                let (pressed, less) = (signal(circuit, low), signal(circuit, low + 1));
                prop_assert!((0.0..=1000.0).contains(&pressed) && pressed >= less);
            }
        }
    }

    #[test]
    fn the_line_goes_through_both_its_ends() {
        assert_eq!(FsrCircuit::resistance_ohm(0.2), 30_000.0);
        assert!((FsrCircuit::resistance_ohm(10.0) - 1000.0).abs() < 1e-9);
        assert!((EXPONENT - 30.0_f64.ln() / 50.0_f64.ln()).abs() < 1e-15);
    }

    #[test]
    fn the_edges_read_as_they_should() {
        for wiper in [0, 1, FsrCircuit::MIDDLE_WIPER, 254, 255] {
            let circuit = FsrCircuit { wiper };
            for nothing in [0.0, -0.0, -3.0, f64::NAN, f64::NEG_INFINITY, 0.099_999, f64::MIN_POSITIVE] {
                assert_eq!(circuit.counts(nothing), FsrCircuit::OPEN_COUNTS, "{nothing} N");
            }
            let full = circuit.counts(10.0);
            for huge in [10.1, 1e300, f64::INFINITY] {
                assert_eq!(circuit.counts(huge), full);
            }
            assert_eq!((circuit.newton(1023), circuit.newton(u16::MAX)), (0.0, 0.0));
            assert_eq!((circuit.newton(full), circuit.newton(0)), (10.0, 10.0));
            assert_eq!(
                (circuit.logarithmic(1023), circuit.logarithmic(full), circuit.logarithmic(0)),
                (0.0, 1000.0, 1000.0)
            );
            assert_eq!((circuit.linearised(1023, 10.0), circuit.linearised(full, 10.0)), (0.0, 1000.0));
            assert_eq!(circuit.linearised(full, 4.0), 1000.0);
        }
        // By hand: 1 kΩ under 52 Ω, and under 49.86 kΩ.
        assert_eq!(FsrCircuit { wiper: 0 }.counts(10.0), 973);
        assert_eq!(FsrCircuit { wiper: 255 }.counts(10.0), 20);
        assert_eq!((FsrCircuit::convert(-5.0), FsrCircuit::convert(2e9), FsrCircuit::convert(f64::NAN)), (0, 1023, 0));
    }

    #[test]
    fn the_middle_wiper_is_the_geometric_mean_of_the_range() {
        let range = [FsrCircuit::BREAK_NEWTON, FsrCircuit::SATURATION_NEWTON].map(FsrCircuit::resistance_ohm);
        let off = |wiper: u8| (FsrCircuit { wiper }.divider_ohm() - (range[0] * range[1]).sqrt()).abs();
        assert!((0..=255).all(|wiper| off(FsrCircuit::MIDDLE_WIPER) <= off(wiper)));
    }
}
