//! **fit**: what presses, as the contact under the skin's own response that explains a touch's taxels best.
//!
//! The layer over the sensors blurs a contact's pressure by a Gaussian of σ; a taxel feels the integral over its area, as
//! `docs/explanation/simulation.md` has it. Four kinds of contact are tried: a `point`, a `line` without ends, a `segment`
//! with ends, and a `blob` with two spreads ([`kinds`]). Each is fitted to the touch's pressed taxels Pᵢ and to their neighbours by least
//! squares of
//!
//! rᵢ = (mᵢ − Pᵢ) / √(σᵢ² + (g·mᵢ)² + (f·max P)²)
//!
//! where m is what the contact would make a taxel feel, σᵢ the noise of P, g the spread of the sensors' gains, and f the kind's
//! floor ([`kinds`]): layers have tails that a Gaussian lacks, and on quiet sensors these would leave no kind standing ([`objective`]). A
//! taxel at 0 says only that m is not over its threshold: it counts where it is. A prior holds the contact's spread near what touches have.
//!
//! **Descent.** Levenberg and Marquardt's, from the touch's moments, for a fixed number of steps; a step that does not help
//! is not taken ([`descent`]). A segment starts from the line. Nothing is kept from frame to frame, so that a recording that
//! is cut anywhere has the same fits.
//!
//! **Kind.** Of the kinds the one with the least χ² + prior + 2·[`choice::PENALTY`] a parameter + Σ ln(D²/(D² − (f·max P)²)), D the
//! residual's denominator: a likelihood pays for the room that a floor gives ([`choice`]). The errors' covariance is (JᵀJ)⁻¹ where the
//! descent ends, widened by χ² a spare taxel if that is over 1; a force has 4 % more for the layer.
//!
//! **Absent** is a fit whose touch has under three pressed taxels (`few_taxels`), whose place no sensor is near (`off_skin`), or without
//! the layer's σ (`no_layer`). A contact whose ends lie beyond the sensors, as a line's do, has a place and an angle, but no force and no
//! length: `off_skin` too.
//!
//! **In doubt** is one of three or four pressed taxels (`few_taxels`), whose spread is the prior's, and one that does not explain the
//! taxels or has not come to rest (`poor_fit`).
//!
//! This stage is for touches of the whole body. It starts from raw values, in f64 on the host, whatever the backend. [`Real`] lets it
//! fit several touches side by side, with the bits of one alone.

mod choice;
mod descent;
mod kinds;
#[cfg(test)]
pub(crate) mod made_up;
mod mass;
mod objective;
mod place;
mod real;
mod shape;
mod touch;

pub(crate) use choice::{Explained, Fit, Fits, fit, fit_alone};
pub(crate) use descent::STEPS;
pub(crate) use objective::{Sensor, USUAL_WIDTH};
pub(crate) use real::Real;
pub(crate) use touch::{Layer, Pull, Start, Taxel, Touch};
