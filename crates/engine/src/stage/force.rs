//! Force: what presses on a field, in newtons.
//!
//! Σ PᵢAᵢ over the field's taxels where P is a pressure in Pa, Σ Pᵢ where it is a force in N; in both cases without the
//! weights, which say how much a taxel counts and not how hard it is pressed. It is made on the host, in double precision
//! on every backend, of the pressures that the backend calibrated.
//!
//! **Bound.** Single precision's P is off by at most 2u·P and what a curve loses; a sum of n terms in double precision adds
//! n·2⁻⁵³ of itself.

use super::{Pressed, SLACK, U};
use crate::signal::Quantity;

/// How many newtons a taxel of `area` m² (0 if unknown) adds for each unit of P. `None` if that is not known.
pub(crate) fn newtons_per_p(quantity: Quantity, area: f64) -> Option<f64> {
    match quantity {
        Quantity::Count => None,
        Quantity::Pascal => (area > 0.0).then_some(area),
        Quantity::Newton => Some(1.0),
    }
}

/// The force of taxels, each with its P and its area; `None` where it is not known.
pub(crate) fn reference(quantity: Quantity, taxels: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    // An untouched field of taxels without areas has no known force either.
    let mut sum = (quantity != Quantity::Count).then_some(0.0)?;
    for (pressure, area) in taxels {
        sum += newtons_per_p(quantity, area)? * pressure;
    }
    Some(sum)
}

/// How far that may be off for what single precision makes of the `pressed` taxels.
pub(crate) fn bound(quantity: Quantity, pressed: &[Pressed]) -> f64 {
    let n = pressed.len() as f64;
    let bound_of = |taxel: &Pressed| {
        let newtons = newtons_per_p(quantity, taxel.area).unwrap_or(0.0);
        newtons * (2.0 * U * taxel.pressure + taxel.excess + n * f64::EPSILON * taxel.pressure)
    };
    SLACK * pressed.iter().map(bound_of).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_is_pressure_times_area_whatever_the_weight() {
        let taxels = [(1000.0, 1e-4), (0.0, 1e-4), (500.0, 2e-4)];
        assert_eq!(reference(Quantity::Pascal, taxels.into_iter()), Some(0.2));
        assert_eq!(reference(Quantity::Newton, taxels.into_iter()), Some(1500.0));
        assert_eq!(reference(Quantity::Count, taxels.into_iter()), None);
        assert_eq!(reference(Quantity::Pascal, std::iter::empty()), Some(0.0));
    }

    #[test]
    fn an_unknown_area_makes_an_unknown_force_even_where_nothing_presses() {
        assert_eq!(reference(Quantity::Pascal, [(0.0, 0.0), (1.0, 1e-4)].into_iter()), None);
        assert_eq!(reference(Quantity::Newton, [(2.0, 0.0), (1.0, 1e-4)].into_iter()), Some(3.0));
    }

    #[test]
    fn single_precision_stays_within_the_bound_and_less_does_not() {
        let areas = (0..300).map(|i| 1e-5 * (1.0 + f64::from(i % 7)));
        let pressures = (0..300).map(|i| 1e4 * (1.0 + f64::from(i) / 7.0));
        let taxels: Vec<(f64, f64)> = pressures.zip(areas).collect();
        let pressed: Vec<Pressed> =
            taxels.iter().map(|&(pressure, area)| Pressed { pressure, area, ..Pressed::default() }).collect();
        let right = reference(Quantity::Pascal, taxels.iter().copied()).unwrap();
        let up = taxels.iter().map(|&(p, area)| (f64::from((p * (1.0 + U)) as f32), area));
        let off = (reference(Quantity::Pascal, up).unwrap() - right).abs();
        let bound = bound(Quantity::Pascal, &pressed);
        assert!(off > 0.1 * bound && off <= bound, "{off} of {bound}");
    }
}
