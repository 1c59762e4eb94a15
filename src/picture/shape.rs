//! The geometry of a picture: the surface with smooth normals, and a disc for each taxel.

use std::collections::BTreeSet;
use std::f64::consts::TAU;

use glam::DVec3;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::colour::{self, linear};
use crate::backend::gpu::raster::{Corner, Slice};
use crate::body::{Body, Modality, Taxel, Topology};
use crate::field::Field;

/// Faces that meet at less than 45° are shaded as one smooth surface.
const SMOOTH_COSINE: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// A disc's radius as a share of the distance to the nearest other.
const RADIUS_SHARE: f64 = 0.40;
/// Maximum radius of a disc, in typical radii.
const MAX_RADIUS_RATIO: f64 = 2.0;
/// Radius of the dark rim, in radii.
pub(super) const RIM: f64 = 1.16;
/// Radius of the rim of a taxel that is part of a touch, in radii.
const TOUCHED_RIM: f64 = 1.32;
/// Offset of discs towards the eye, in radii, so that a curved surface does not hide them; of discs of another kind, which are
/// behind.
const LIFT: f64 = 0.6;
const OTHER_LIFT: f64 = 0.3;
/// Fields with taxels nearer than this many typical distances are neighbours.
const NEIGHBOUR_SPACINGS: f64 = 1.6;
/// Maximum number of slices of a disc.
const MAX_SLICES: usize = 8;
/// Taxels nearer than this are coincident, m.
const COINCIDENT_M: f64 = 1e-6;

/// How the disc of a taxel is drawn that shows what it reads.
#[derive(Clone, Copy)]
pub(super) struct Disc {
    pub(super) colour: [u8; 3],
    /// The colour of the wide rim of a taxel that is part of a touch.
    pub(super) touched: Option<[u8; 3]>,
    /// Whether it measures something else than what is shown: it is behind, and as large as the nearest of any kind leaves room for.
    pub(super) is_other: bool,
    /// The share of its radius that is drawn.
    pub(super) share: f64,
}

/// The discs of taxels.
#[derive(Clone)]
pub(super) struct Dots {
    /// In the body at rest, m.
    pub(super) places: Vec<DVec3>,
    pub(super) normals: Vec<DVec3>,
    /// m.
    pub(super) radii: Vec<f64>,
    /// Those that the nearest of any kind leaves room for, m.
    narrow_radii: Vec<f64>,
    /// Typical distance of neighbours, m.
    spacing_m: f64,
}

impl Dots {
    /// The dots of `body`'s taxels at rest, none larger than its taxel.
    pub(super) fn from_body(body: &Body) -> Self {
        let way = |link: usize| body.links[link].body_from_link;
        let places = body.taxels.iter().map(|t| way(t.link).transform_point3(t.position_in_link)).collect();
        let normals = body.taxels.iter().map(|t| way(t.link).transform_vector3(t.normal_in_link)).collect();
        let extent = body
            .triangles_at_rest()
            .iter()
            .flat_map(|(_, corners)| *corners)
            .fold(0.0, |most: f64, p| most.max(p.abs().max_element()));
        let mut dots = Self::at(places, normals, extent);
        for (radius, taxel) in dots.radii.iter_mut().zip(&body.taxels) {
            *radius = radius.min(largest_radius(taxel));
        }
        dots.narrow_radii.clone_from(&dots.radii);
        dots
    }

    /// At `places`; a single one is drawn as if its neighbours were a tenth of `extent_m` away.
    pub(super) fn at(places: Vec<DVec3>, normals: Vec<DVec3>, extent_m: f64) -> Self {
        let gaps = gaps(&places);
        let spacing_m = median(&gaps).unwrap_or((0.1 * extent_m).max(1e-3));
        let radii: Vec<f64> = gaps.iter().map(|gap| radius(*gap, spacing_m)).collect();
        Self { places, normals, narrow_radii: radii.clone(), radii, spacing_m }
    }

    /// The same of these `taxels`, each as large as the nearest of its own kind leaves room for, where others are drawn small.
    pub(super) fn by_kind<'a>(mut self, taxels: impl Iterator<Item = &'a Taxel>) -> Self {
        // What is pressed is one skin, with one axis or three.
        let is_skin = |kind: Modality| kind.is_pressed();
        let taxels: Vec<&Taxel> = taxels.collect();
        let mut kinds: Vec<Modality> = Vec::new();
        for taxel in &taxels {
            let is_known = |kind: &Modality| *kind == taxel.modality || is_skin(*kind) && is_skin(taxel.modality);
            if !kinds.iter().any(is_known) {
                kinds.push(taxel.modality);
            }
        }
        if kinds.len() < 2 {
            return self;
        }
        let mut own_gaps = vec![None; taxels.len()];
        for kind in &kinds {
            let is_own = |index: &usize| {
                let modality = taxels[*index].modality;
                modality == *kind || is_skin(modality) && is_skin(*kind)
            };
            let own: Vec<usize> = (0..taxels.len()).filter(is_own).collect();
            let places: Vec<DVec3> = own.iter().map(|&index| self.places[index]).collect();
            own.iter().zip(gaps(&places)).for_each(|(&index, gap)| own_gaps[index] = gap);
        }
        let spacing_m = median(&own_gaps).unwrap_or(self.spacing_m);
        for (index, gap) in own_gaps.into_iter().enumerate() {
            let wide = radius(gap, spacing_m).min(largest_radius(taxels[index]));
            self.radii[index] = wide.max(self.narrow_radii[index]);
        }
        self
    }

    /// Typical distance of neighbours, m.
    pub(super) fn spacing_m(&self) -> f64 {
        self.spacing_m
    }

    /// m.
    pub(super) fn mean_radius(&self) -> f64 {
        self.radii.iter().sum::<f64>() / self.radii.len().max(1) as f64
    }

    /// Pairs of `fields` that share taxels or are neighbours, as indices in that list.
    pub(super) fn beside(&self, fields: &[&Field]) -> BTreeSet<(usize, usize)> {
        let mut of_taxel: Vec<Vec<usize>> = vec![Vec::new(); self.places.len()];
        for (number, field) in fields.iter().enumerate() {
            field.members.iter().for_each(|member| of_taxel[member.taxel].push(number));
        }
        let tree =
            RTree::bulk_load(self.places.iter().zip(0..).map(|(p, i)| GeomWithData::new(p.to_array(), i)).collect());
        let reach = NEIGHBOUR_SPACINGS * self.spacing_m;
        let mut pairs = BTreeSet::new();
        for (place, own) in self.places.iter().zip(&of_taxel) {
            for near in tree.locate_within_distance(place.to_array(), reach * reach) {
                let near: &GeomWithData<[f64; 3], usize> = near;
                for &one in own {
                    pairs.extend(of_taxel[near.data].iter().filter(|&&other| other > one).map(|&other| (one, other)));
                }
            }
        }
        pairs
    }

    /// The `discs` relative to `middle`, unlit: a colour is what the legend says.
    pub(super) fn flat_slices(&self, discs: &[Disc], middle: DVec3, rims: bool) -> Vec<Slice> {
        let mut slices = Vec::with_capacity(2 * discs.len());
        for (taxel, &Disc { colour, touched, is_other, share }) in discs.iter().enumerate() {
            let (whole, lift) =
                if is_other { (self.narrow_radii[taxel], OTHER_LIFT) } else { (self.radii[taxel], LIFT) };
            let radius = share * whole;
            // A lift is in radii of the slice: the disc stays in front.
            match touched {
                Some(rim) => {
                    let (wide, lift) = (TOUCHED_RIM * radius, lift / (TOUCHED_RIM * share));
                    slices.push(self.slice(taxel, middle, (wide, lift), rim, (0.0, TAU)));
                }
                None if rims => {
                    slices.push(self.slice(taxel, middle, (RIM * radius, lift / share), colour::RIM, (0.0, TAU)));
                }
                None => {}
            }
            let slice = self.slice(taxel, middle, (radius, (lift + 0.1) / share), colour, (0.0, TAU));
            slices.push(Slice { colour: [slice.colour[0], slice.colour[1], slice.colour[2], 0.0], ..slice });
        }
        slices
    }

    /// A piece of the disc of a taxel, relative to `middle`: its radius in m and its lift in radii, start and sweep in rad.
    fn slice(
        &self,
        taxel: usize,
        middle: DVec3,
        (radius, lift): (f64, f64),
        colour: [u8; 3],
        (start, sweep): (f64, f64),
    ) -> Slice {
        let [r, g, b] = linear(colour).map(|part| part as f32);
        Slice {
            middle: (self.places[taxel] - middle).as_vec3().to_array(),
            radius: radius as f32,
            normal: self.normals[taxel].as_vec3().to_array(),
            lift: lift as f32,
            colour: [r, g, b, 1.0],
            span: [start as f32, sweep as f32, 0.0, 0.0],
        }
    }

    /// The discs, relative to `middle`: each has a slice in the colour of each of its fields.
    pub(super) fn slices(&self, fields: &[(&Field, [u8; 3])], middle: DVec3, rims: bool) -> Vec<Slice> {
        let mut of_taxel: Vec<Vec<[u8; 3]>> = vec![Vec::new(); self.places.len()];
        for (field, colour) in fields {
            field.members.iter().for_each(|member| of_taxel[member.taxel].push(*colour));
        }
        let mut slices = Vec::with_capacity(2 * self.places.len());
        for (taxel, colours) in of_taxel.iter_mut().enumerate() {
            if rims {
                slices.push(self.slice(taxel, middle, (RIM * self.radii[taxel], LIFT), colour::RIM, (0.0, TAU)));
            }
            if colours.is_empty() {
                colours.push(colour::REST);
            }
            colours.truncate(MAX_SLICES);
            let sweep = TAU / colours.len() as f64;
            for (number, &colour) in colours.iter().enumerate() {
                // Above the rim by more than the depth resolution.
                let piece = (number as f64 * sweep, sweep);
                slices.push(self.slice(taxel, middle, (self.radii[taxel], LIFT + 0.1), colour, piece));
            }
        }
        slices
    }
}

/// By place, how far the nearest other one is, m.
fn gaps(places: &[DVec3]) -> Vec<Option<f64>> {
    let tree = RTree::bulk_load(places.iter().map(DVec3::to_array).collect());
    let gap = |place: &DVec3| {
        let near = tree.nearest_neighbor_iter_with_distance_2(place.to_array()).take(32);
        near.map(|(_, squared)| squared.sqrt()).find(|&distance| distance > COINCIDENT_M)
    };
    places.iter().map(gap).collect()
}

/// The median of the gaps that are known.
fn median(gaps: &[Option<f64>]) -> Option<f64> {
    let mut known: Vec<f64> = gaps.iter().flatten().copied().collect();
    known.sort_by(f64::total_cmp);
    known.get(known.len() / 2).copied()
}

/// The radius of a disc that has its nearest neighbour at `gap` where they usually are `spacing_m` apart, m.
fn radius(gap: Option<f64>, spacing_m: f64) -> f64 {
    RADIUS_SHARE * gap.unwrap_or(spacing_m).min(MAX_RADIUS_RATIO * spacing_m)
}

/// The radius of the disc of the area of a taxel, m; infinite if it has none.
fn largest_radius(taxel: &Taxel) -> f64 {
    if taxel.area > 0.0 { (taxel.area / std::f64::consts::PI).sqrt() } else { f64::INFINITY }
}

/// The surface of `triangles` relative to `middle`: corners with normals, and triangles. A corner's normal is the
/// area-weighted mean of the faces around it within 45° of this one.
pub(super) fn surface(triangles: &[(usize, [DVec3; 3])], middle: DVec3) -> (Vec<Corner>, Vec<[u32; 3]>) {
    let soup: Vec<DVec3> = triangles.iter().flat_map(|(_, corners)| corners.map(|p| p - middle)).collect();
    let faces: Vec<[u32; 3]> = (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let topology = Topology::new(&soup, &faces);
    let count = topology.triangles.len() as u32;
    // Twice the area along the normal, and its direction.
    let spanned: Vec<DVec3> = (0..count)
        .map(|triangle| {
            let [a, b, c] = topology.corners(triangle);
            (b - a).cross(c - a)
        })
        .collect();
    let facing: Vec<DVec3> = spanned.iter().map(|n| n.normalize_or(DVec3::Z)).collect();
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); topology.positions.len()];
    for (triangle, corners) in (0..count).zip(&topology.triangles) {
        corners.iter().for_each(|&vertex| around[vertex as usize].push(triangle));
    }
    let mut corners = Vec::with_capacity(3 * count as usize);
    for (triangle, vertices) in (0..count).zip(&topology.triangles) {
        let own = facing[triangle as usize];
        for &vertex in vertices {
            let smooth =
                around[vertex as usize].iter().filter(|&&other| facing[other as usize].dot(own) > SMOOTH_COSINE);
            let normal: DVec3 = smooth.map(|&other| spanned[other as usize]).sum();
            corners.push(Corner {
                position: topology.positions[vertex as usize].as_vec3().to_array(),
                normal: normal.normalize_or(own).as_vec3().to_array(),
            });
        }
    }
    (corners, (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect())
}
