//! What presses, as a fit found it.

use super::typed::Typed as _;
use super::{ContactKind, Host};

/// A contact in a field's chart, as the fit's outputs have it (`docs/fit.md`).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Fit {
    /// Its kind.
    pub kind: ContactKind,
    /// Its middle (u, v), m; of a line the point nearest to the touch's centroid.
    pub place: [f64; 2],
    /// Its force, in N where P is in Pa, else in the unit of P; absent where it goes on beyond the sensors.
    pub force: Option<f64>,
    /// Its direction along, rad in [0, π); absent for a point.
    pub angle: Option<f64>,
    /// The standard deviation of its pressure across, at the sensors, m.
    pub width: f64,
    /// Of a segment from end to end, m; of a blob the standard deviation of its pressure along.
    pub length: Option<f64>,
    /// Standard deviations, where the noise of the sensors is known.
    pub sigma: Option<FitSigma>,
}

/// Standard deviations of a [`Fit`], each in the unit of what it belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FitSigma {
    /// Of a line only what it is off across.
    pub place: [f64; 2],
    /// Of the force.
    pub force: f64,
    /// Of the angle.
    pub angle: f64,
    /// Of the width.
    pub width: f64,
    /// Of the length.
    pub length: f64,
}

impl Fit {
    /// The components of one of the fit's outputs, if it has it.
    pub(crate) fn components(&self, host: Host) -> Option<[f64; 3]> {
        let sigma = self.sigma;
        match host {
            Host::FitKind => Some(self.kind.components()),
            Host::FitPlace => Some(self.place.components()),
            Host::FitPlaceSigma => Some(sigma?.place.components()),
            Host::FitForce => Some(self.force?.components()),
            Host::FitForceSigma => self.force.and(Some(sigma?.force.components())),
            Host::FitAngle => Some(self.angle?.components()),
            Host::FitAngleSigma => self.angle.and(Some(sigma?.angle.components())),
            Host::FitWidth => Some(self.width.components()),
            Host::FitWidthSigma => Some(sigma?.width.components()),
            Host::FitLength => Some(self.length?.components()),
            Host::FitLengthSigma => self.length.and(Some(sigma?.length.components())),
            _ => None,
        }
    }
}
