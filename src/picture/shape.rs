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
/// Radius of discs of one size at most, as a share of the distance to the nearest other: their rims touch.
const TOUCHING_SHARE: f64 = 0.43;
/// Taxels of another kind are dots of this share of the radius of small discs of the kind that is shown.
const OTHER_SHARE: f64 = 0.45;
/// Radius of the dark rim, in radii.
pub(super) const RIM: f64 = 1.16;
/// Radius of the rim of a taxel that is part of a touch, in radii.
const TOUCHED_RIM: f64 = 1.32;
/// Offset of discs towards the eye, in radii, so that a curved surface does not hide them; of discs of another kind, which are
/// behind; and of small ones over them, in radii of the largest of those.
const LIFT: f64 = 0.6;
const OTHER_LIFT: f64 = 0.3;
const DOT_LIFT: f64 = 0.85;
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
    /// What it measures.
    pub(super) kind: DiscKind,
}

/// Whether a taxel measures what is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DiscKind {
    Shown,
    /// It does not: a disc behind others, as large as they are.
    Behind,
    /// It does not: a small dot behind others.
    Small,
}

/// The discs of taxels.
#[derive(Clone)]
pub(super) struct Dots {
    /// In the body at rest, m.
    pub(super) places: Vec<DVec3>,
    pub(super) normals: Vec<DVec3>,
    /// m.
    pub(super) radii: Vec<f64>,
    /// Which lie over the others as dots, and how far these are lifted towards the eye, m.
    are_dots: Vec<bool>,
    dot_lift_m: f64,
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
        dots
    }

    /// At `places`; a single one is drawn as if its neighbours were a tenth of `extent_m` away.
    pub(super) fn at(places: Vec<DVec3>, normals: Vec<DVec3>, extent_m: f64) -> Self {
        let gaps = gaps(&places);
        let spacing_m = median(&gaps).unwrap_or((0.1 * extent_m).max(1e-3));
        let radii: Vec<f64> = gaps.iter().map(|gap| radius(*gap, spacing_m)).collect();
        Self { are_dots: vec![false; places.len()], dot_lift_m: 0.0, places, normals, radii, spacing_m }
    }

    /// The same of these `taxels`, each as large as the nearest of its own kind leaves room for, where others are drawn small or not at
    /// all. Skin has discs that grow with its spacing; sensors in between are points, so all of a kind have one size.
    pub(super) fn by_kind<'a>(mut self, taxels: impl Iterator<Item = &'a Taxel>) -> Self {
        let taxels: Vec<&Taxel> = taxels.collect();
        let kinds = kinds_of(&taxels);
        if kinds.len() < 2 {
            return self;
        }
        let gaps_of = |own: &Vec<usize>| gaps(&own.iter().map(|&index| self.places[index]).collect::<Vec<_>>());
        let own_gaps: Vec<Vec<Option<f64>>> = kinds.iter().map(gaps_of).collect();
        let spacing_m = median(&own_gaps.concat()).unwrap_or(self.spacing_m);
        for (own, gaps) in kinds.iter().zip(own_gaps) {
            let is_skin = own.iter().any(|&index| taxels[index].modality.is_pressed());
            let usual_m = radius(low_quarter(gaps.iter().flatten().copied()), spacing_m);
            for (&index, gap) in own.iter().zip(gaps) {
                let room_m = match gap {
                    gap if is_skin => radius(gap, spacing_m),
                    Some(gap) => usual_m.min(TOUCHING_SHARE * gap),
                    None => usual_m,
                };
                self.radii[index] = room_m.min(largest_radius(taxels[index]));
            }
        }
        self
    }

    /// The same for pictures that show all kinds: as [`Dots::by_kind`], where what is no skin, if there is any, lies as small dots over
    /// the rest.
    pub(super) fn of_all_kinds<'a>(self, taxels: impl Iterator<Item = &'a Taxel> + Clone) -> Self {
        let mut dots = self.by_kind(taxels.clone());
        let taxels: Vec<&Taxel> = taxels.collect();
        let kinds = kinds_of(&taxels);
        let skin = kinds.iter().max_by_key(|own| (taxels[own[0]].modality.is_pressed(), own.len()));
        let Some(skin) = skin.filter(|_| kinds.len() > 1) else { return dots };
        let small_m = OTHER_SHARE * low_quarter(skin.iter().map(|&index| dots.radii[index])).unwrap_or(f64::INFINITY);
        dots.are_dots = vec![true; taxels.len()];
        skin.iter().for_each(|&index| dots.are_dots[index] = false);
        dots.dot_lift_m = DOT_LIFT * skin.iter().map(|&index| dots.radii[index]).fold(0.0, f64::max);
        for (radius, _) in dots.radii.iter_mut().zip(&dots.are_dots).filter(|(_, is_dot)| **is_dot) {
            *radius = radius.min(small_m);
        }
        dots
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
        let shown = discs.iter().zip(&self.radii).filter(|(disc, _)| disc.kind == DiscKind::Shown);
        let usual_m = low_quarter(shown.map(|(_, &radius)| radius)).unwrap_or(f64::INFINITY);
        for (taxel, &Disc { colour, touched, kind }) in discs.iter().enumerate() {
            let own = self.radii[taxel];
            let (whole, lift, share) = match kind {
                DiscKind::Shown => (own, LIFT, 1.0),
                DiscKind::Behind => (own, OTHER_LIFT, 1.0),
                DiscKind::Small => (own.min(usual_m), OTHER_LIFT, OTHER_SHARE),
            };
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
            let radius = self.radii[taxel];
            // Lifts are in radii of each slice: one that is much higher than its radius has the same height with its rim.
            let [rim_lift, lift] = match self.are_dots[taxel] {
                true => [1.0 / RIM, 1.0].map(|share| share * self.dot_lift_m / radius),
                false => [LIFT; 2],
            };
            if rims {
                slices.push(self.slice(taxel, middle, (RIM * radius, rim_lift), colour::RIM, (0.0, TAU)));
            }
            if colours.is_empty() {
                colours.push(colour::REST);
            }
            colours.truncate(MAX_SLICES);
            let sweep = TAU / colours.len() as f64;
            for (number, &colour) in colours.iter().enumerate() {
                // Above the rim by more than the depth resolution.
                let piece = (number as f64 * sweep, sweep);
                slices.push(self.slice(taxel, middle, (radius, lift + 0.1), colour, piece));
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

/// By kind of `taxels`, which of them it has. What is pressed is one skin, with one axis or three.
fn kinds_of(taxels: &[&Taxel]) -> Vec<Vec<usize>> {
    let mut kinds: Vec<(Modality, Vec<usize>)> = Vec::new();
    for (index, taxel) in taxels.iter().enumerate() {
        let kind = if taxel.modality.is_pressed() { Modality::Pressure } else { taxel.modality };
        match kinds.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, own)) => own.push(index),
            None => kinds.push((kind, vec![index])),
        }
    }
    kinds.into_iter().map(|(_, own)| own).collect()
}

/// What a quarter of `numbers` are less than, if there are any.
fn low_quarter(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let mut sorted: Vec<f64> = numbers.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 4).copied()
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

#[cfg(test)]
mod tests {
    use super::*;

    const PITCH_M: f64 = 0.006;

    fn taxel(id: usize, modality: Modality, place: DVec3) -> Taxel {
        Taxel {
            id: id as u32,
            link: 0,
            position_in_link: place,
            normal_in_link: DVec3::Z,
            area: 0.0,
            modality,
            tangent_in_link: None,
        }
    }

    /// A skin of 4 x 4, and two thermistors near to its taxels, that are 7 mm apart.
    fn mixed() -> (Vec<Taxel>, Dots) {
        let skin = (0..16).map(|i| DVec3::new(f64::from(i % 4), f64::from(i / 4), 0.0) * PITCH_M);
        let places: Vec<DVec3> = skin.chain([DVec3::new(0.0005, 0.0, 0.0), DVec3::new(0.0075, 0.0, 0.0)]).collect();
        let kind = |id: usize| if id < 16 { Modality::Pressure } else { Modality::Temperature };
        let taxels = places.iter().enumerate().map(|(id, &place)| taxel(id, kind(id), place)).collect();
        let normals = vec![DVec3::Z; places.len()];
        (taxels, Dots::at(places, normals, 0.02))
    }

    #[test]
    fn a_disc_is_as_large_as_its_own_kind_leaves_room_for() {
        let (taxels, any) = mixed();
        assert!((any.radii[0] - RADIUS_SHARE * 0.0005).abs() < 1e-9, "by the nearest of any kind");
        let own = any.clone().by_kind(taxels.iter());
        assert!(own.radii[..16].iter().all(|radius| (radius - RADIUS_SHARE * PITCH_M).abs() < 1e-9), "{:?}", own.radii);
        assert!(own.radii[16..].iter().all(|radius| (radius - RADIUS_SHARE * 0.007).abs() < 1e-9), "{:?}", own.radii);
        // Where all kinds are shown, thermistors are dots over the skin.
        let all = any.of_all_kinds(taxels.iter());
        assert_eq!(all.radii[..16], own.radii[..16]);
        assert!(all.radii[16..].iter().all(|radius| (radius - OTHER_SHARE * own.radii[0]).abs() < 1e-9));
        let slices = all.slices(&[], DVec3::ZERO, false);
        let lift_m = |taxel: usize| slices[taxel].lift * slices[taxel].radius;
        assert!(lift_m(16) > lift_m(0) && slices.len() == 18, "{} and {}", lift_m(16), lift_m(0));
        // Each over its own rim.
        let slices = all.slices(&[], DVec3::ZERO, true);
        let lifts_m: Vec<f32> = slices.iter().map(|slice| slice.lift * slice.radius).collect();
        assert!(lifts_m.len() == 36 && lifts_m.chunks(2).all(|own| own[1] > own[0]), "{lifts_m:?}");
    }

    #[test]
    fn sensors_of_one_kind_have_one_size_but_where_two_would_overlap() {
        let places = [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 53.0, 80.0].map(|x| DVec3::new(x * 1e-3, 0.0, 0.0));
        let places: Vec<DVec3> = places.into_iter().chain([DVec3::Y]).collect();
        let kind = |id: usize| if id < 8 { Modality::Temperature } else { Modality::Pressure };
        let taxels: Vec<Taxel> = (0..9).map(|id| taxel(id, kind(id), places[id])).collect();
        let radii = Dots::at(places, vec![DVec3::Z; 9], 0.1).by_kind(taxels.iter()).radii;
        let usual = RADIUS_SHARE * 0.010;
        for (taxel, radius) in radii[..8].iter().enumerate() {
            let expected = if [5, 6].contains(&taxel) { TOUCHING_SHARE * 0.003 } else { usual };
            assert!((radius - expected).abs() < 1e-9, "{taxel}: {radius}");
        }
    }

    #[test]
    fn what_is_not_shown_is_smaller_than_all_that_is() {
        let (taxels, any) = mixed();
        let dots = any.by_kind(taxels.iter());
        for shown in [Modality::Pressure, Modality::Temperature] {
            let disc = |taxel: &Taxel| {
                let kind = if taxel.modality == shown { DiscKind::Shown } else { DiscKind::Small };
                Disc { colour: [0; 3], touched: None, kind }
            };
            let discs: Vec<Disc> = taxels.iter().map(disc).collect();
            let slices = dots.flat_slices(&discs, DVec3::ZERO, false);
            let radii = |kind: DiscKind| {
                slices.iter().zip(&discs).filter(move |(_, disc)| disc.kind == kind).map(|(slice, _)| slice.radius)
            };
            let most = radii(DiscKind::Small).fold(0.0, f32::max);
            let least = radii(DiscKind::Shown).fold(f32::INFINITY, f32::min);
            assert!(most > 0.0 && most <= 0.46 * least, "{shown:?}: {most} and {least}");
        }
    }
}
