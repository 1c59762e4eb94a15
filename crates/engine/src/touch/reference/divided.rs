//! The regions of a frame as they are right.

use std::collections::BTreeSet;

use glam::DVec3;

use super::{Reference, Region, Scene};
use crate::touch::options::CANDIDATE_SIGMAS;

impl Reference {
    /// The regions, and the pairs of peaks that met and are two.
    pub(super) fn regions(&self, scene: &Scene<'_>) -> (Vec<Region>, Vec<(u32, u32)>) {
        let pressure = |node: u32| scene.pressure(node);
        let is_higher = |a: u32, b: u32| pressure(a) > pressure(b) || (pressure(a) == pressure(b) && a < b);
        let mut nodes: Vec<u32> = (0..scene.skin.nodes() as u32).filter(|&node| pressure(node) > 0.0).collect();
        nodes.sort_by(|&a, &b| if is_higher(a, b) { std::cmp::Ordering::Less } else { std::cmp::Ordering::Greater });
        let mut regions: Vec<Region> = Vec::new();
        let mut two: Vec<(u32, u32)> = Vec::new();
        let mut swept: BTreeSet<u32> = BTreeSet::new();
        for &node in &nodes {
            let mut higher: Vec<u32> = scene.beside[node as usize].intersection(&swept).copied().collect();
            higher
                .sort_by(|&a, &b| if is_higher(a, b) { std::cmp::Ordering::Less } else { std::cmp::Ordering::Greater });
            swept.insert(node);
            let home = |regions: &[Region], node: u32| regions.iter().position(|region| region.nodes.contains(&node));
            let Some(&highest) = higher.first() else {
                regions.push(Region { peak: node, nodes: BTreeSet::from([node]), in_doubt: false });
                continue;
            };
            // All that were swept are in a region.
            let Some(joined) = home(&regions, highest) else { continue };
            // One of another region that is as good as equally high.
            for &other in &higher {
                let Some(beyond) = home(&regions, other) else { continue };
                if beyond != joined && scene.are_near(pressure(other), pressure(highest)) {
                    regions[beyond].in_doubt = true;
                    regions[joined].in_doubt = true;
                }
            }
            regions[joined].nodes.insert(node);
            let peak_of = |&other: &u32| home(&regions, other).map(|home| regions[home].peak);
            let mut peaks: Vec<u32> = higher.iter().filter_map(peak_of).collect();
            peaks
                .sort_by(|&a, &b| if is_higher(a, b) { std::cmp::Ordering::Less } else { std::cmp::Ordering::Greater });
            peaks.dedup();
            for peak in peaks {
                let (Some(own), Some(other)) = (home(&regions, node), home(&regions, peak)) else { continue };
                if own == other {
                    continue;
                }
                let (high, low) =
                    if is_higher(regions[own].peak, regions[other].peak) { (own, other) } else { (other, own) };
                let pair = (regions[high].peak, regions[low].peak);
                if two.contains(&pair) {
                    continue;
                }
                let (are_two, in_doubt) = self.are_two(scene, node, &regions[high], &regions[low]);
                regions[high].in_doubt |= in_doubt;
                regions[low].in_doubt |= in_doubt;
                if are_two {
                    two.push(pair);
                } else {
                    let merged = regions[low].clone();
                    regions[high].nodes.extend(merged.nodes);
                    regions[high].in_doubt |= merged.in_doubt;
                    regions.remove(low);
                }
            }
        }
        regions.sort_by(
            |a, b| {
                if is_higher(a.peak, b.peak) { std::cmp::Ordering::Less } else { std::cmp::Ordering::Greater }
            },
        );
        let is_peak = |peak: u32| regions.iter().any(|region| region.peak == peak);
        two.retain(|&(a, b)| is_peak(a) && is_peak(b));
        (regions, two)
    }

    /// Whether two regions that meet at `saddle` are two, and whether that is in doubt.
    fn are_two(&self, scene: &Scene<'_>, saddle: u32, high: &Region, low: &Region) -> (bool, bool) {
        let (skin, splits) = (scene.skin, &scene.options.splits);
        let before = (self.touch_before(high.peak), self.touch_before(low.peak));
        let were_two = match before {
            (Some(a), Some(b)) => self.two.contains(&(a.min(b), a.max(b))),
            _ => false,
        };
        let (s, p) = (scene.pressure(saddle), scene.pressure(low.peak));
        let least = splits.candidate * p - CANDIDATE_SIGMAS * skin.taxels()[low.peak as usize].reading.sigma;
        let near_least = (s - least).abs() <= scene.within * p;
        if !were_two && s >= least {
            return (false, near_least);
        }
        // Peaks, or the moment of the meeting, may be others.
        let is_tied = |region: &Region| {
            let peak = scene.pressure(region.peak);
            region.nodes.iter().any(|&node| node != region.peak && scene.are_near(scene.pressure(node), peak))
        };
        let is_near_saddle = |region: &Region| {
            let around = region.nodes.iter().flat_map(|&node| &scene.beside[node as usize]).chain(&region.nodes);
            around.into_iter().any(|&node| node != saddle && scene.are_near(scene.pressure(node), s))
        };
        let choice = [high, low].iter().any(|region| is_tied(region) || is_near_saddle(region));
        let Some((dip, lower_end)) = scene.dip(high, low) else { return (false, choice) };
        let limit = if were_two { splits.join } else { splits.split } * lower_end;
        let two = if were_two { dip <= limit } else { dip < limit };
        (two, choice || (!were_two && near_least) || (dip - limit).abs() <= 4.0 * (scene.within + 1e-7) * lower_end)
    }
}

impl Scene<'_> {
    pub(super) fn pressure(&self, node: u32) -> f64 {
        if self.frame.without_value.contains(&node) { 0.0 } else { self.frame.pressures[node as usize].max(0.0) }
    }

    /// Whether it may be otherwise which of the two is larger.
    pub(super) fn are_near(&self, a: f64, b: f64) -> bool {
        self.within > 0.0 && (a - b).abs() <= self.within * (a.abs() + b.abs())
    }

    /// Where `node` lies in the chart of `base`, across the base's normal.
    pub(super) fn place(&self, base: u32, node: u32) -> DVec3 {
        let [base, taxel] = [base, node].map(|node| &self.skin.taxels()[node as usize]);
        let (r, n0, n) = (taxel.position - base.position, base.mean_normal, taxel.mean_normal);
        let t = r - r.dot(n0) * n0;
        let across = n - n.dot(n0) * n0;
        if across.length() < 1e-9 {
            return t;
        }
        let theta = across.length().atan2(n.dot(n0));
        let e = across.normalize();
        let m = e * (theta / 2.0).cos() - n0 * (theta / 2.0).sin();
        t + e * (r.dot(m) * (theta / 2.0) / (theta / 2.0).sin() - t.dot(e))
    }

    /// The least mean pressure between two peaks, and the lower one at the ends.
    pub(super) fn dip(&self, high: &Region, low: &Region) -> Option<(f64, f64)> {
        let own = || high.nodes.iter().chain(&low.nodes);
        let around = own().flat_map(|&node| &self.beside[node as usize]);
        let nodes: BTreeSet<u32> = own().chain(around).copied().collect();
        let mut cells: Vec<f64> = nodes.iter().map(|&node| self.skin.taxels()[node as usize].cell_m2).collect();
        cells.sort_by(f64::total_cmp);
        let d = cells[cells.len() / 2].sqrt();
        let position = |node: u32| self.skin.taxels()[node as usize].position;
        let middle = (position(high.peak) + position(low.peak)) / 2.0;
        let far = |node: &u32| position(*node).distance_squared(middle);
        // The first of equally near ones is the lowest.
        let &base = nodes.iter().min_by(|a, b| far(a).total_cmp(&far(b)))?;
        let from = self.place(base, high.peak);
        let line = self.place(base, low.peak) - from;
        let length = line.length();
        if length == 0.0 || d == 0.0 {
            return None;
        }
        let (along, across) = (line / length, self.skin.taxels()[base as usize].mean_normal.cross(line / length));
        let samples = ((length / (0.25 * d)).floor() as usize + 1).clamp(5, 257);
        let mean = |sample: usize| {
            let at = length * sample as f64 / (samples - 1) as f64;
            let (mut weights, mut pulls) = (0.0, 0.0);
            for &node in &nodes {
                let offset = self.place(base, node) - from;
                let away = offset.dot(along) - at;
                if offset.dot(across).abs() <= 1.2 * d && away.abs() <= 3.0 * d {
                    let weight = (-0.5 * (away / (0.4 * d)).powi(2)).exp();
                    weights += weight;
                    pulls += weight * self.pressure(node);
                }
            }
            (weights > 0.0).then(|| pulls / weights)
        };
        let means: Vec<Option<f64>> = (0..samples).map(mean).collect();
        let lower_end = means[0]?.min(means[samples - 1]?);
        Some((means.into_iter().flatten().fold(f64::INFINITY, f64::min), lower_end))
    }
}
