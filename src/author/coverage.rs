//! How much of a body's skin its taxels see, and where it is bare.

use glam::DVec3;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use crate::body::{Body, Taxel};

/// Places on the surface that are looked at, at least; and for each taxel.
const LEAST_SAMPLES: usize = 20_000;
const SAMPLES_A_TAXEL: usize = 8;
const MOST_SAMPLES: usize = 200_000;

/// Neighbours that a taxel's spacing is the mean distance of.
const NEIGHBOURS: usize = 3;

/// Taxels looked at for one that faces the same way, before a place counts as bare.
const MOST_TRIES: usize = 32;

/// Taxels nearer than this to each other are at one place, m.
const ONE_PLACE_M: f64 = 1e-6;

/// Bare samples are one spot where they are nearer than so many times what they would lie apart on a square grid.
const JOINED: f64 = 2.0;

/// Bare spots that are told.
const MOST_HOLES: usize = 3;

/// What a link's skin is like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkCoverage {
    /// Index of the link.
    pub link: usize,
    /// Surface it carries, m².
    pub area: f64,
    /// Of that, what lies within the spacing of a taxel that faces the same way, m².
    pub seen: f64,
}

/// A bare spot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hole {
    /// Index of the link that carries the surface at its middle.
    pub link: usize,
    /// About its middle, in that link's frame, m.
    pub position_in_link: DVec3,
    /// How large it is, m².
    pub area: f64,
}

/// Coverage of a body by its taxels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coverage {
    /// Links that carry surface.
    pub links: Vec<LinkCoverage>,
    /// The largest connected bare spots on links of which some is seen, largest first.
    pub holes: Vec<Hole>,
}

impl Coverage {
    /// Area and seen area of all links of which some is seen, m². Links that nothing sees are no skin.
    #[must_use]
    pub fn of_skin(&self) -> (f64, f64) {
        let skin = self.links.iter().filter(|link| link.seen > 0.0);
        skin.fold((0.0, 0.0), |(area, seen), link| (area + link.area, seen + link.seen))
    }
}

/// A bare place on the surface, in the world at rest.
struct Sample {
    position: DVec3,
    normal: DVec3,
    link: usize,
}

/// How much of `body` its taxels see, at rest.
///
/// A taxel sees what lies within its spacing, in a straight line, and faces the same way, less than 90° from its normal:
/// the far side of a thin part is not seen. Its spacing is the mean distance of the three nearest taxels that do. The
/// surface is sampled, at 20,000 places at least, and 8 a taxel up to 200,000: areas are good to about a percent of the whole.
#[must_use]
pub fn coverage(body: &Body) -> Coverage {
    let taxels = Taxels::of(body);
    let corners: Vec<(usize, [DVec3; 3])> = body.triangles_at_rest();
    let area_of = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).length() / 2.0;
    let mut links: Vec<LinkCoverage> =
        (0..body.links.len()).map(|link| LinkCoverage { link, area: 0.0, seen: 0.0 }).collect();
    corners.iter().for_each(|&(link, triangle)| links[link].area += area_of(triangle));
    let whole: f64 = links.iter().map(|link| link.area).sum();
    links.retain(|link| link.area > 0.0);
    if body.taxels.is_empty() || !(whole.is_finite() && whole > 0.0) {
        return Coverage { links, holes: Vec::new() };
    }

    let count = (SAMPLES_A_TAXEL * body.taxels.len()).clamp(LEAST_SAMPLES, MOST_SAMPLES);
    let each = whole / count as f64;
    let mut seen = vec![0.0; body.links.len()];
    let (mut taken, mut bare) = (0, Vec::new());
    let mut up_to = 0.0;
    for (link, triangle) in corners {
        up_to += area_of(triangle);
        let [a, b, c] = triangle;
        let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
        // One every `each` of area, so that small triangles have their fair share.
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

/// The taxels, in the world at rest.
struct Taxels {
    tree: RTree<GeomWithData<[f64; 3], usize>>,
    normals: Vec<DVec3>,
    /// m.
    spacings: Vec<f64>,
}

impl Taxels {
    fn of(body: &Body) -> Self {
        let of_world = |taxel: &Taxel| body.links[taxel.link].world_from_link;
        let place = |taxel: &Taxel| of_world(taxel).transform_point3(taxel.position_in_link);
        let places: Vec<DVec3> = body.taxels.iter().map(place).collect();
        let normals = body.taxels.iter().map(|taxel| of_world(taxel).transform_vector3(taxel.normal_in_link)).collect();
        let tree = RTree::bulk_load(places.iter().zip(0..).map(|(p, i)| GeomWithData::new(p.to_array(), i)).collect());
        let mut taxels = Self { tree, normals, spacings: Vec::new() };
        let spacing = |(&p, &normal): (&DVec3, &DVec3)| {
            let others = taxels.facing(p, normal).map(|(_, distance)| distance);
            let others: Vec<f64> = others.filter(|&distance| distance > ONE_PLACE_M).take(NEIGHBOURS).collect();
            others.iter().sum::<f64>() / others.len().max(1) as f64
        };
        taxels.spacings = places.iter().zip(&taxels.normals).map(spacing).collect();
        taxels
    }

    /// Those near `p` whose normals are less than 90° from `normal`, nearest first, each with its distance, m.
    fn facing(&self, p: DVec3, normal: DVec3) -> impl Iterator<Item = (usize, f64)> {
        let near = self.tree.nearest_neighbor_iter_with_distance_2(p.to_array()).take(MOST_TRIES);
        let near = near.map(|(taxel, squared)| (taxel.data, squared.sqrt()));
        near.filter(move |&(taxel, _)| self.normals[taxel].dot(normal) > 0.0)
    }
}

/// Where in its triangle sample `index` lies: weights of the second and third corner, spread evenly over many samples
/// (Roberts, *The Unreasonable Effectiveness of Quasirandom Sequences*, 2018: steps of 1/g and 1/g², g³ = g + 1).
fn within(index: u32) -> [f64; 2] {
    let step = |by: f64| (0.5 + by * f64::from(index)).fract();
    let [beta, gamma] = [step(0.754_877_666_246_692_7), step(0.569_840_290_998_053_3)];
    if beta + gamma > 1.0 { [1.0 - beta, 1.0 - gamma] } else { [beta, gamma] }
}

/// The largest connected parts of what is bare, on links of which some is seen.
fn holes(body: &Body, mut bare: Vec<Sample>, seen: &[f64], each: f64) -> Vec<Hole> {
    bare.retain(|sample| seen[sample.link] > 0.0);
    let tree = bare.iter().zip(0..).map(|(sample, i)| GeomWithData::new(sample.position.to_array(), i)).collect();
    let tree: RTree<GeomWithData<[f64; 3], usize>> = RTree::bulk_load(tree);
    let reach_squared = (JOINED * JOINED) * each;
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
        let link_from_world = body.links[middle.link].world_from_link.inverse();
        let position_in_link = link_from_world.transform_point3(middle.position);
        Some(Hole { link: middle.link, position_in_link, area: members.len() as f64 * each })
    };
    parts.iter().take(MOST_HOLES).filter_map(hole).collect()
}
