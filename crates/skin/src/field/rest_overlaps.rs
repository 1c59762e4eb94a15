//! How near touches of two links must be to count as one contact, and which links are that near at rest.

use std::collections::{BTreeMap, BTreeSet};

use rstar::RTree;
use rstar::primitives::GeomWithData;

use crate::body::Body;

/// What layers, and poses that are a little off, may put between two skins that touch, m.
const BETWEEN_SKINS_M: f64 = 0.005;

/// How far the places of two touches may be apart that are one contact.
///
/// By default it is d_a/√2 + d_b/√2 + 5 mm, d being the median distance between nearest taxels of a link. A point of a
/// square grid is at most d/√2 from the nearest taxel, which is how far off a touch is that only one taxel feels; the rest is
/// for layers and for poses that are a little off.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactTolerance {
    /// Where it is the same for all links.
    given_m: Option<f64>,
    /// d/√2, by link; 0 where a link has fewer than two taxels.
    reach_m: Vec<f64>,
}

impl ContactTolerance {
    /// The tolerance of `body`, or `given_m` for all of its links.
    #[must_use]
    pub fn new(body: &Body, given_m: Option<f64>) -> Self {
        let mut places: Vec<Vec<[f64; 3]>> = vec![Vec::new(); body.links.len()];
        for taxel in &body.taxels {
            places[taxel.link].push(taxel.position_in_link.to_array());
        }
        let reach_m = places.into_iter().map(|places| median_spacing_m(&places) * std::f64::consts::FRAC_1_SQRT_2);
        Self { given_m, reach_m: reach_m.collect() }
    }

    /// Between links `a` and `b`, m.
    #[must_use]
    pub fn between_m(&self, a: usize, b: usize) -> f64 {
        self.given_m.unwrap_or_else(|| self.reach_m[a] + self.reach_m[b] + BETWEEN_SKINS_M)
    }
}

/// The median distance between nearest taxels, m; 0 where there are none.
fn median_spacing_m(places: &[[f64; 3]]) -> f64 {
    let tree = RTree::bulk_load(places.to_vec());
    let nearest =
        |place: &[f64; 3]| tree.nearest_neighbor_iter_with_distance_2(*place).map(|(_, d2)| d2).find(|&d2| d2 > 0.0);
    let mut distances: Vec<f64> = places.iter().filter_map(nearest).map(f64::sqrt).collect();
    distances.sort_by(f64::total_cmp);
    distances.get(distances.len() / 2).copied().unwrap_or_default()
}

/// Taxels of two links that are within the tolerance of each other at the body's rest pose.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct RestOverlap {
    /// Both links, the lower index first.
    pub links: [usize; 2],
    /// The tolerance between them, m.
    pub tolerance_m: f64,
    /// How near the nearest two taxels are, m.
    pub nearest_m: f64,
    /// The taxels of either link that are within the tolerance of one of the other, by ascending index.
    pub taxels: [Vec<usize>; 2],
    /// Pairs of these whose normals are over 120° apart: pressed at once, they are a contact.
    pub facing: usize,
}

/// Which links of `body` have taxels within `tolerance` of each other at rest, by ascending index.
#[must_use]
pub fn rest_overlaps(body: &Body, tolerance: &ContactTolerance) -> Vec<RestOverlap> {
    type Near = (f64, [BTreeSet<usize>; 2], usize);
    let mut found = BTreeMap::<[usize; 2], Near>::new();
    let place = |index: usize| {
        let taxel = &body.taxels[index];
        let body_from_link = &body.links[taxel.link].body_from_link;
        (
            body_from_link.transform_point3(taxel.position_in_link),
            body_from_link.transform_vector3(taxel.normal_in_link).normalize_or_zero(),
        )
    };
    let places: Vec<_> = (0..body.taxels.len()).map(place).collect();
    let points = places.iter().enumerate().map(|(index, (place, _))| GeomWithData::new(place.to_array(), index));
    let tree = RTree::bulk_load(points.collect());
    let links: BTreeSet<usize> = body.taxels.iter().map(|taxel| taxel.link).collect();
    let farthest = |own: usize| {
        links.iter().filter(|&&link| link != own).map(|&link| tolerance.between_m(own, link)).fold(0.0, f64::max)
    };
    let farthest: BTreeMap<usize, f64> = links.iter().map(|&link| (link, farthest(link))).collect();
    for (index, (place, normal)) in places.iter().enumerate() {
        let own = body.taxels[index].link;
        let reach_m = farthest[&own];
        for other in tree.locate_within_distance(place.to_array(), reach_m * reach_m).map(|other| other.data) {
            let link = body.taxels[other].link;
            let distance_m = place.distance(places[other].0);
            if link <= own || distance_m > tolerance.between_m(own, link) {
                continue;
            }
            let (nearest_m, taxels, facing) =
                found.entry([own, link]).or_insert_with(|| (f64::INFINITY, Default::default(), 0));
            *nearest_m = nearest_m.min(distance_m);
            taxels[0].insert(index);
            taxels[1].insert(other);
            *facing += usize::from(normal.dot(places[other].1) < -0.5);
        }
    }
    let overlap = |(links, (nearest_m, taxels, facing)): ([usize; 2], Near)| RestOverlap {
        links,
        tolerance_m: tolerance.between_m(links[0], links[1]),
        nearest_m,
        taxels: taxels.map(|taxels| taxels.into_iter().collect()),
        facing,
    };
    found.into_iter().map(overlap).collect()
}
