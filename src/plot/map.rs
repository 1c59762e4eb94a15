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
    /// Half the distance to a neighbour, m: what is around a taxel's place is its own.
    half_spacing_m: f64,
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
        Self { field: field.name.clone(), radius_m, half_spacing_m: 0.5 * widest_m / RADIUS_SHARE, taxels, path }
    }

    /// The lower and upper corner of the map, m: maps beside each other are farther apart than their taxels.
    pub(super) fn extent(&self) -> [(f64, f64); 2] {
        let r = self.radius_m.max(self.half_spacing_m);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_is_half_a_distance_of_neighbours_wider_than_its_places() {
        let taxels: Vec<MappedTaxel> = (0..6)
            .map(|i| MappedTaxel { at: (f64::from(i % 3) * 0.01, f64::from(i / 3) * 0.01), peak: 0.0, integral: 0.0 })
            .collect();
        let half_spacing_m = 0.5 * widest_radius_m(&taxels) / RADIUS_SHARE;
        // However small the discs are.
        let map = PressureMap { field: String::new(), taxels, radius_m: 0.001, half_spacing_m, path: Vec::new() };
        let [low, high] = map.extent();
        let found = [low.0, low.1, high.0, high.1];
        assert!(found.iter().zip([-0.005, -0.005, 0.025, 0.015]).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
    }
}
