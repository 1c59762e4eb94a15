//! The share of a body's surface that its taxels cover, and the largest holes.

use glam::DVec3;

use super::placed::COINCIDENT_M;
use crate::body::{Body, PointTree, Taxel, area_vector, point_tree};

/// Number of samples of the surface: limits, and samples per taxel.
const MIN_SAMPLES: usize = 20_000;
const SAMPLES_PER_TAXEL: usize = 8;
const MAX_SAMPLES: usize = 200_000;

/// Number of neighbours for a taxel's spacing.
const NEIGHBOURS: usize = 3;

/// Maximum number of nearest taxels to search for one that faces the same way.
const MAX_CANDIDATES: usize = 32;

/// Bare samples nearer to each other than this belong to one hole; in spacings of a square grid of the samples.
const HOLE_LINK_DISTANCE: f64 = 2.0;

const MAX_HOLES: usize = 3;

/// The coverage of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkCoverage {
    /// Index of the link.
    pub link: usize,
    /// Its surface, m².
    pub area: f64,
    /// The part within the spacing of a taxel that faces the same way, m².
    pub seen: f64,
}

/// A connected part of the surface without taxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hole {
    /// Index of the link of its middle.
    pub link: usize,
    /// A point near its middle, in that link's frame, m.
    pub position_in_link: DVec3,
    /// Its area, m².
    pub area: f64,
}

/// Coverage of a body by its taxels.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Coverage {
    /// Links with a surface.
    pub links: Vec<LinkCoverage>,
    /// The largest holes on partly covered links, largest first.
    pub holes: Vec<Hole>,
}

impl Coverage {
    /// Area and covered area of all partly covered links, m².
    #[must_use]
    pub fn of_skin(&self) -> (f64, f64) {
        let surface = self.links.iter().filter(|link| link.seen > 0.0);
        surface.fold((0.0, 0.0), |(area, seen), link| (area + link.area, seen + link.seen))
    }
}

/// A sample of bare surface, in the body at rest.
struct Sample {
    position: DVec3,
    normal: DVec3,
    link: usize,
}

/// The coverage of `body` by its taxels, at rest.
///
/// A taxel covers the surface within its spacing, in a straight line, with normals less than 90° from its own. Its spacing
/// is the mean distance of the three nearest such taxels. The surface is sampled at 8 points per taxel, 20,000 to 200,000:
/// areas are accurate to about a percent of the total.
#[must_use]
pub fn coverage(body: &Body) -> Coverage {
    let taxels = Taxels::from_body(body);
    let corners: Vec<(usize, [DVec3; 3])> = body.triangles_at_rest();
    let area_of = |corners: [DVec3; 3]| area_vector(corners).length() / 2.0;
    let mut links: Vec<LinkCoverage> =
        (0..body.links.len()).map(|link| LinkCoverage { link, area: 0.0, seen: 0.0 }).collect();
    corners.iter().for_each(|&(link, triangle)| links[link].area += area_of(triangle));
    let whole: f64 = links.iter().map(|link| link.area).sum();
    links.retain(|link| link.area > 0.0);
    if body.taxels.is_empty() || !(whole.is_finite() && whole > 0.0) {
        return Coverage { links, holes: Vec::new() };
    }

    let count = (SAMPLES_PER_TAXEL * body.taxels.len()).clamp(MIN_SAMPLES, MAX_SAMPLES);
    let each = whole / count as f64;
    let mut seen = vec![0.0; body.links.len()];
    let (mut taken, mut bare) = (0, Vec::new());
    let mut up_to = 0.0;
    for (link, triangle) in corners {
        up_to += area_of(triangle);
        let [a, b, c] = triangle;
        let Some(normal) = area_vector(triangle).try_normalize() else { continue };
        // One sample per area `each`, also over small triangles.
        while (f64::from(taken) + 0.5) * each < up_to {
            let [beta, gamma] = within(taken);
            let position = a + (b - a) * beta + (c - a) * gamma;
            match taxels.facing(position, normal).next() {
                Some((taxel, distance)) if distance <= taxels.spacings[taxel] => seen[link] += each,
                _ => bare.push(Sample { position, normal, link }),
            }
            taken += 1;
        }
    }
    for link in &mut links {
        link.seen = seen[link.link].min(link.area);
    }
    let holes = holes(body, bare, &seen, each);
    Coverage { links, holes }
}

/// The taxels, in the body at rest.
struct Taxels {
    tree: PointTree,
    normals: Vec<DVec3>,
    spacings: Vec<f64>,
}

impl Taxels {
    fn from_body(body: &Body) -> Self {
        let of_body = |taxel: &Taxel| body.links[taxel.link].body_from_link;
        let place = |taxel: &Taxel| of_body(taxel).transform_point3(taxel.position_in_link);
        let places: Vec<DVec3> = body.taxels.iter().map(place).collect();
        let normals = body.taxels.iter().map(|taxel| of_body(taxel).transform_vector3(taxel.normal_in_link)).collect();
        let tree = point_tree(places.iter().copied());
        let mut taxels = Self { tree, normals, spacings: Vec::new() };
        let spacing = |(&p, &normal): (&DVec3, &DVec3)| {
            let others = taxels.facing(p, normal).map(|(_, distance)| distance);
            let others: Vec<f64> = others.filter(|&distance| distance > COINCIDENT_M).take(NEIGHBOURS).collect();
            others.iter().sum::<f64>() / others.len().max(1) as f64
        };
        taxels.spacings = places.iter().zip(&taxels.normals).map(spacing).collect();
        taxels
    }

    /// Taxels near `p` with normals less than 90° from `normal`, nearest first, with distances, m.
    fn facing(&self, p: DVec3, normal: DVec3) -> impl Iterator<Item = (usize, f64)> {
        let near = self.tree.nearest_neighbor_iter_with_distance_2(p.to_array()).take(MAX_CANDIDATES);
        let near = near.map(|(taxel, squared)| (taxel.data, squared.sqrt()));
        near.filter(move |&(taxel, _)| self.normals[taxel].dot(normal) > 0.0)
    }
}

/// Weights of the second and third corner of sample `index` in its triangle: a quasirandom sequence
/// (Roberts, *The Unreasonable Effectiveness of Quasirandom Sequences*, 2018: steps of 1/g and 1/g², g³ = g + 1).
fn within(index: u32) -> [f64; 2] {
    let step = |by: f64| (0.5 + by * f64::from(index)).fract();
    let [beta, gamma] = [step(0.754_877_666_246_692_7), step(0.569_840_290_998_053_3)];
    if beta + gamma > 1.0 { [1.0 - beta, 1.0 - gamma] } else { [beta, gamma] }
}

/// The largest connected bare parts on partly covered links.
fn holes(body: &Body, mut bare: Vec<Sample>, seen: &[f64], each: f64) -> Vec<Hole> {
    bare.retain(|sample| seen[sample.link] > 0.0);
    let tree = point_tree(bare.iter().map(|sample| sample.position));
    let reach_squared = (HOLE_LINK_DISTANCE * HOLE_LINK_DISTANCE) * each;
    let mut part = vec![usize::MAX; bare.len()];
    let mut parts: Vec<Vec<usize>> = Vec::new();
    for start in 0..bare.len() {
        if part[start] != usize::MAX {
            continue;
        }
        part[start] = parts.len();
        let mut members = vec![start];
        let mut next = 0;
        while let Some(&at) = members.get(next) {
            next += 1;
            for near in tree.locate_within_distance(bare[at].position.to_array(), reach_squared) {
                if part[near.data] == usize::MAX && bare[near.data].normal.dot(bare[at].normal) > 0.0 {
                    part[near.data] = parts.len();
                    members.push(near.data);
                }
            }
        }
        parts.push(members);
    }
    parts.sort_by_key(|members| std::cmp::Reverse(members.len()));
    let hole = |members: &Vec<usize>| {
        let mean = members.iter().map(|&i| bare[i].position).sum::<DVec3>() / members.len() as f64;
        let off = |&i: &usize| bare[i].position.distance_squared(mean);
        let middle = &bare[members.iter().copied().min_by(|a, b| off(a).total_cmp(&off(b)))?];
        let link_from_body = body.links[middle.link].body_from_link.inverse();
        let position_in_link = link_from_body.transform_point3(middle.position);
        Some(Hole { link: middle.link, position_in_link, area: members.len() as f64 * each })
    };
    parts.iter().take(MAX_HOLES).filter_map(hole).collect()
}
