//! How a sensor answers to several known forces.

/// A sensor's curve from known forces.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownCurve {
    /// Of the sensor; `None` for the middle of all, which sensors have that were not pressed.
    pub id: Option<u32>,
    /// How far the sensor went, in raw units, and the force, N; from nothing on.
    pub knots: Vec<[f64; 2]>,
}

impl KnownCurve {
    /// The force where the sensor went `raw` units, N; the last step goes on.
    pub(super) fn at(&self, raw: f64) -> f64 {
        let next = self.knots.iter().position(|knot| knot[0] > raw).unwrap_or(self.knots.len() - 1).max(1);
        let ([from, low], [to, high]) = (self.knots[next - 1], self.knots[next]);
        low + (raw - from) * (high - low) / (to - from)
    }

    /// The force for each raw unit up to the heaviest known one, N; what comes after that is no measurement.
    pub(super) fn gain(&self) -> Option<f64> {
        let [.., [raw, newtons], _] = self.knots[..] else { return None };
        (raw > 0.0).then(|| newtons / raw)
    }

    pub(super) fn name(&self) -> String {
        self.id.map_or_else(|| "usual".to_owned(), |id| format!("taxel_{id}"))
    }
}
