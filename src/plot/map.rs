//! A field's chart with what each taxel has felt.

use crate::field::Field;

/// Share of the distance to the nearest neighbour that a disc's radius is at most.
const RADIUS_SHARE: f64 = 0.46;

/// A field's taxels on its chart, their highest pressures and integrals over time, and the path of the centre of pressure.
#[derive(Clone, Debug)]
pub(super) struct PressureMap {
    pub(super) field: String,
    pub(super) taxels: Vec<MappedTaxel>,
    /// Radius of a taxel's disc, m: that of its area, but no larger than leaves a gap between neighbours.
    pub(super) radius_m: f64,
    /// The path of the centre of pressure, (u, v), m.
    pub(super) path: Vec<Vec<(f64, f64)>>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct MappedTaxel {
    /// (u, v), m.
    pub(super) at: (f64, f64),
    pub(super) peak: f64,
    /// ∫ P dt.
    pub(super) integral: f64,
}

impl PressureMap {
    /// The map of the taxels of `field` that are pressed; `peaks`, `integrals`, `areas_m2` and `are_pressed` are by taxel of the body.
    pub(super) fn new(
        field: &Field,
        path: Vec<Vec<(f64, f64)>>,
        peaks: &[f64],
        integrals: &[f64],
        areas_m2: &[f64],
        are_pressed: &[bool],
    ) -> Self {
        let pressed = || field.members.iter().filter(|member| are_pressed[member.taxel]);
        let taxels: Vec<MappedTaxel> = pressed()
            .map(|member| MappedTaxel {
                at: (member.place.x, member.place.y),
                peak: peaks[member.taxel],
                integral: integrals[member.taxel],
            })
            .collect();
        let widest_m = widest_radius_m(&taxels);
        let mut areas: Vec<f64> = pressed().map(|member| areas_m2[member.taxel]).collect();
        areas.sort_by(f64::total_cmp);
        let own_m = (areas.get(areas.len() / 2).copied().unwrap_or(0.0) / std::f64::consts::PI).sqrt();
        let radius_m = if own_m > 0.0 { own_m.min(widest_m) } else { widest_m };
        Self { field: field.name.clone(), radius_m, taxels, path }
    }

    /// The lower and upper corner of what is drawn, m.
    pub(super) fn extent(&self) -> [(f64, f64); 2] {
        let r = self.radius_m;
        self.taxels.iter().fold([(f64::MAX, f64::MAX), (f64::MIN, f64::MIN)], |[low, high], taxel| {
            let (u, v) = taxel.at;
            [(low.0.min(u - r), low.1.min(v - r)), (high.0.max(u + r), high.1.max(v + r))]
        })
    }
}

/// By the median distance to the nearest neighbour.
fn widest_radius_m(taxels: &[MappedTaxel]) -> f64 {
    // A sample is enough, and so is a square number of comparisons of it.
    let step = taxels.len().div_ceil(400).max(1);
    let mut nearest: Vec<f64> = taxels
        .iter()
        .step_by(step)
        .filter_map(|one| {
            let apart = |other: &MappedTaxel| libm::hypot(one.at.0 - other.at.0, one.at.1 - other.at.1);
            taxels.iter().map(apart).filter(|&distance| distance > 1e-9).min_by(f64::total_cmp)
        })
        .collect();
    nearest.sort_by(f64::total_cmp);
    nearest.get(nearest.len() / 2).map_or(1e-3, |distance| RADIUS_SHARE * distance)
}
