//! Whether there is a dip between two peaks: the mean pressure along the line between them.
//!
//! The line runs in the chart based at the taxel nearest to the middle of the two peaks. The mean at a place of it is over the
//! taxels of both regions and their neighbours, those without pressure too, with the weights exp(−½(along / 0.4 d)²), of those at
//! most 1.2 d across and 3 d along from the place; d is the root of their median cell (of an even number
//! the larger of the middle two). It is taken at max(5, ⌊L / 0.25 d⌋ + 1)
//! places from peak to peak, L apart, up to 257; a place without a taxel does not count.
//!
//! A mean of several taxels, as single ones differ by their gains, and along a line, as a mean over all around hides two fingers.

use super::bridges::Bridges;
use super::chart;
use super::skin::Skin;

/// Spread of the weights along the line, in d.
const SPREAD: f64 = 0.4;
/// How far across the line a taxel may be, in d.
const ACROSS: f64 = 1.2;
/// How far along the line a taxel may be from a place, in d: there it has e⁻¹⁸ of the weight.
const ALONG: f64 = 3.0;
/// Distance of places, in d.
const STEP: f64 = 0.25;
/// The least and the greatest number of places.
const LEAST_PLACES: usize = 5;
const MOST_PLACES: usize = 257;

/// The mean pressure along a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Dip {
    /// The least on the line.
    pub(super) least: f64,
    /// The lower one of its two ends.
    pub(super) lower_end: f64,
}

/// The number of places on a line of the length `length_m`, for cells of the size `d_m`.
pub(super) fn places(length_m: f64, d_m: f64) -> usize {
    ((length_m / (STEP * d_m)) as usize).saturating_add(1).clamp(LEAST_PLACES, MOST_PLACES)
}

/// Memory for the search of dips.
#[derive(Clone, Debug, Default)]
pub(super) struct Profile {
    /// By node the last search that met it.
    seen: Vec<u32>,
    search: u32,
    nodes: Vec<u32>,
    cells_m2: Vec<f64>,
    /// By place Σw and ΣwP.
    sums: Vec<[f64; 2]>,
}

impl Profile {
    /// The dip between the `peaks` of two regions with these `members`. `None` if the peaks are at one place.
    pub(super) fn dip(
        &mut self,
        skin: &Skin,
        bridges: &Bridges,
        pressures: &[f64],
        members: impl Iterator<Item = u32>,
        peaks: [u32; 2],
    ) -> Option<Dip> {
        self.gather(skin, bridges, members);
        let cells = self.nodes.iter().map(|&node| skin.taxel(node).cell_m2);
        self.cells_m2.clear();
        self.cells_m2.extend(cells);
        let middle = self.cells_m2.len() / 2;
        if self.cells_m2.is_empty() {
            return None;
        }
        let d_m = self.cells_m2.select_nth_unstable_by(middle, f64::total_cmp).1.sqrt();
        let [a, b] = peaks.map(|peak| skin.taxel(peak));
        let half_way = (a.position + b.position) / 2.0;
        let far = |node: u32| skin.taxel(node).position.distance_squared(half_way);
        let nearest = self.nodes.iter().map(|&node| (far(node), node));
        let (_, base) = nearest.min_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)))?;
        let base = skin.taxel(base);
        let normal = base.mean_normal;
        let place = |node: u32| {
            let taxel = skin.taxel(node);
            chart::place(taxel.position - base.position, normal, taxel.mean_normal)
        };
        let [from, to] = peaks.map(place);
        let length_m = from.distance(to);
        if !(length_m > 0.0 && d_m > 0.0) {
            return None;
        }
        let (along, count) = ((to - from) / length_m, places(length_m, d_m));
        let (across, step_m) = (normal.cross(along), length_m / (count - 1) as f64);
        self.sums.clear();
        self.sums.resize(count, [0.0; 2]);
        let line = Line { step_m, spread_m: SPREAD * d_m, reach_m: ALONG * d_m };
        for &node in &self.nodes {
            let offset = place(node) - from;
            if offset.dot(across).abs() <= ACROSS * d_m {
                line.add(offset.dot(along), pressures[node as usize], &mut self.sums);
            }
        }
        let mean = |sums: &[f64; 2]| (sums[0] > 0.0).then(|| sums[1] / sums[0]);
        let ends = [self.sums.first().and_then(mean)?, self.sums.last().and_then(mean)?];
        let least = self.sums.iter().filter_map(mean).fold(f64::INFINITY, f64::min);
        Some(Dip { least, lower_end: ends[0].min(ends[1]) })
    }

    /// Puts `members` and their neighbours into `nodes`, each once.
    fn gather(&mut self, skin: &Skin, bridges: &Bridges, members: impl Iterator<Item = u32>) {
        self.seen.resize(skin.nodes(), 0);
        self.search = self.search.wrapping_add(1);
        if self.search == 0 {
            self.seen.fill(0);
            self.search = 1;
        }
        self.nodes.clear();
        let (seen, nodes, search) = (&mut self.seen, &mut self.nodes, self.search);
        let mut take = |node: u32| {
            if std::mem::replace(&mut seen[node as usize], search) != search {
                nodes.push(node);
            }
        };
        for member in members {
            take(member);
            bridges.beside(skin, member, &mut take);
        }
    }
}

/// The places on a line.
struct Line {
    step_m: f64,
    spread_m: f64,
    reach_m: f64,
}

impl Line {
    /// Adds a taxel at `x_m` along the line to the sums of the places within reach.
    fn add(&self, x_m: f64, pressure: f64, sums: &mut [[f64; 2]]) {
        let Self { step_m, spread_m, reach_m } = *self;
        let last = sums.len() - 1;
        // The nearest place; a cast keeps within what there is.
        let nearest = ((x_m / step_m + 0.5) as usize).min(last);
        let off_m = x_m - nearest as f64 * step_m;
        if off_m.abs() > reach_m {
            return;
        }
        let square = spread_m * spread_m;
        let weight = libm::exp(-0.5 * off_m * off_m / square);
        sums[nearest][0] += weight;
        sums[nearest][1] += weight * pressure;
        // From place to place the weight changes by a factor that itself changes by a constant one.
        let constant = libm::exp(-step_m * step_m / square);
        for towards in [1.0, -1.0] {
            let (mut weight, mut away_m, mut place) = (weight, off_m, nearest);
            let mut factor = libm::exp((towards * off_m * step_m - step_m * step_m / 2.0) / square);
            loop {
                place = if towards > 0.0 { place + 1 } else { place.wrapping_sub(1) };
                away_m -= towards * step_m;
                if place > last || away_m.abs() > reach_m {
                    break;
                }
                weight *= factor;
                factor *= constant;
                sums[place][0] += weight;
                sums[place][1] += weight * pressure;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::touch::layouts;

    #[test]
    fn weights_from_place_to_place_are_those_of_the_exponential() {
        let line = Line { step_m: 0.25, spread_m: SPREAD, reach_m: 3.0 };
        for x_m in [-2.9, -0.3, 0.0, 0.1, 1.13, 4.0, 5.7, 8.0] {
            let mut sums = [[0.0; 2]; 25];
            line.add(x_m, 2.0, &mut sums);
            for (place, [weight, pull]) in sums.into_iter().enumerate() {
                let away_m = x_m - 0.25 * place as f64;
                let right = if away_m.abs() <= 3.0 { (-0.5 * (away_m / SPREAD).powi(2)).exp() } else { 0.0 };
                assert!((weight - right).abs() <= 1e-12 * right && pull == 2.0 * weight, "{x_m} {place}: {weight}");
            }
        }
        let mut sums = [[0.0; 2]; 25];
        [-3.1, 9.1].into_iter().for_each(|x_m| line.add(x_m, 1.0, &mut sums));
        assert_eq!(sums, [[0.0; 2]; 25]);
    }

    #[test]
    fn a_row_with_a_gap_dips_and_an_even_one_does_not() {
        let skin = layouts::grid(9, 3, 0.01);
        let row = |pressures: [f64; 9]| -> Vec<f64> {
            (0..27).map(|i| if i / 9 == 1 { pressures[i % 9] } else { 0.0 }).collect()
        };
        let mut profile = Profile::default();
        let mut dip = |pressures: [f64; 9]| {
            let pressures = row(pressures);
            let members = (0..27).filter(|&node| pressures[node as usize] > 0.0).collect::<Vec<_>>();
            profile.dip(&skin, &Bridges::default(), &pressures, members.into_iter(), [10, 16]).unwrap()
        };
        let even = dip([0.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 0.0]);
        // Over three rows, two of them without pressure; at the ends a little less.
        assert!((even.least - even.lower_end).abs() < 1e-12 && (0.5..2.0 / 3.0).contains(&even.least), "{even:?}");
        let gap = dip([0.0, 2.0, 2.0, 1.0, 0.2, 1.0, 2.0, 2.0, 0.0]);
        assert!(gap.least < 0.4 * gap.lower_end, "{gap:?}");
    }

    #[test]
    fn places_are_a_quarter_of_a_cell_apart_within_limits() {
        assert_eq!([0.0, 1.0, 1.99, 2.0, 1e9].map(|length_m| places(length_m, 1.0)), [5, 5, 8, 9, 257]);
        assert_eq!(places(1.0, 1e-300), 257);
    }
}
