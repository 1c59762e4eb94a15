//! **fit**: what presses, as the contact under the skin's own response that explains a touch's taxels best.
//!
//! The layer over the sensors blurs a contact's pressure by a Gaussian of σ; a taxel feels the integral over its area, as
//! `docs/simulation.md` has it. Four kinds of contact are tried: a `point`, a `line` without ends, a `segment` with ends, and
//! a `blob` with two spreads ([`kinds`]). Each is fitted to the touch's pressed taxels Pᵢ and to their neighbours by least
//! squares of
//!
//! rᵢ = (mᵢ − Pᵢ) / √(σᵢ² + (g·mᵢ)²)
//!
//! where m is what the contact would make a taxel feel, σᵢ the noise of P and g the spread of the sensors' gains, which
//! stands for the model's own faults too ([`objective`]). A taxel at 0 says only that m is not over its threshold: it counts
//! where it is. A prior holds the contact's spread near what touches have.
//!
//! **Descent.** Levenberg and Marquardt's, from the touch's moments, for a fixed number of steps; a step that does not help
//! is not taken ([`descent`]). A segment starts from the line. Nothing is kept from frame to frame, so that a recording that
//! is cut anywhere has the same fits.
//!
//! **Kind.** Of the kinds the one with the least χ² + prior + 2·[`choice::PENALTY`] a parameter ([`choice`]). The errors' covariance is
//! (JᵀJ)⁻¹ where the descent ends.
//!
//! **Absent** is a fit whose touch has too few pressed taxels to tell (`few_taxels`: no more than parameters), whose place no
//! sensor is near (`off_field`), that does not explain the taxels or has not come to rest (`poor_fit`), of a field whose chart
//! is too far from flat (`curved`), or without the layer's σ (`no_layer`). A contact whose ends lie beyond the sensors, as a
//! line's do, has a place and an angle, but no force and no length: `off_field` too.
//!
//! This stage starts from raw values, in f64. [`Real`] lets it fit several touches side by side, with the bits of one alone. On
//! backend `gpu` the descents are the device's, in f32 (`shaders/fit.wgsl`); what they reach is judged here, in f64
//! ([`Ends::start`]), so that kind, covariance and reasons for absence are decided alike everywhere.

mod choice;
mod descent;
mod kinds;
#[cfg(test)]
pub(crate) mod made_up;
mod mass;
mod objective;
mod real;
#[cfg(test)]
pub(crate) mod running;
mod shape;
mod touch;
mod trail;

pub(crate) use choice::{Ends, Fits, fit, fit_alone};
pub(crate) use descent::STEPS;
#[cfg(test)]
pub(crate) use descent::descend;
#[cfg(test)]
pub(crate) use kinds::{Blob, Kind, Line, Point, Segment};
pub(crate) use objective::{Sensor, USUAL_WIDTH};
pub(crate) use real::Real;
#[cfg(feature = "gpu")]
pub(crate) use shape::Shape;
pub(crate) use touch::{Layer, Start, Taxel, Touch};
pub(crate) use trail::{OVER_S, Trail};

/// The numbers that `shaders/fit.wgsl` has from here, by the names that it has for them.
#[cfg(feature = "gpu")]
pub(crate) fn numbers() -> Vec<(String, f64)> {
    let named = [
        ("LN_USUAL_WIDTH", libm::log(USUAL_WIDTH)),
        ("PER_WIDTH_VARIES", 1.0 / objective::WIDTH_VARIES),
        ("LONGEST", shape::LONGEST),
        ("WIDEST", shape::WIDEST),
        ("DAMPING", descent::DAMPING),
        ("DAMPING_CHANGES", descent::DAMPING_CHANGES),
        ("LEAST", descent::LEAST),
        ("LN_2", std::f64::consts::LN_2),
        ("LOG2_E", std::f64::consts::LOG2_E),
        ("PER_SQRT_TAU", real::PER_SQRT_TAU),
        ("SQRT_TAU", real::SQRT_TAU),
    ];
    let [above, below] = real::MILLS;
    let each = |name: &'static str, numbers: Vec<f64>| {
        numbers.into_iter().enumerate().map(move |(k, number)| (format!("{name}_{k}"), number))
    };
    let named = named.map(|(name, number)| (name.to_owned(), number)).into_iter();
    let below = [&below[..], &[real::MILLS_LAST]].concat();
    named.chain(each("ABOVE", above.to_vec())).chain(each("BELOW", below)).collect()
}
