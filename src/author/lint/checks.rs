//! The checks, one a function.

use std::collections::BTreeMap;

use glam::DVec3;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::super::ground::Ground;
use super::{Finding, FindingKind, listed};
use crate::body::{Body, ChartKind, FieldSpec, Taxel};
use crate::field::{Field, Unroller};

/// Fewer taxels than this leave orientation and axis little to say.
const FEW: usize = 3;

/// Taxels nearer than this to each other are at one place, m.
const ONE_PLACE_M: f64 = 1e-6;

/// A taxel is isolated where its nearest neighbour is over so many times as far as is usual.
const ISOLATED: f64 = 5.0;

/// A stored normal is current within this of the surface's, rad.
const CURRENT_RAD: f64 = 1e-5;

/// A stored (u, v) is current within this, m, and this part of its distance from the origin: four roundings to single
/// precision along the way.
const CURRENT_M: f64 = 1e-6;
const CURRENT_PART: f64 = 1e-5;

impl Finding {
    fn of_taxels(kind: FindingKind, taxels: Vec<u32>, what: String) -> Self {
        Self { kind, taxels, fields: Vec::new(), worst: None, place: None, what }
    }

    fn of_fields(kind: FindingKind, fields: Vec<String>, what: String) -> Self {
        Self { kind, taxels: Vec::new(), fields, worst: None, place: None, what }
    }
}

/// A taxel's place for people.
fn place(body: &Body, taxel: &Taxel) -> String {
    format!("taxel {} on link `{}`", taxel.id, body.links[taxel.link].name)
}

fn count(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}

pub(super) fn empty(body: &Body) -> Vec<Finding> {
    let mut findings = Vec::new();
    if body.taxels.is_empty() {
        let what = "the body has no taxels, so that it cannot be run";
        findings.push(Finding::of_taxels(FindingKind::NoTaxels, Vec::new(), what.to_owned()));
    }
    if body.fields.is_empty() {
        let what = "the body has no fields, so that it cannot be run";
        findings.push(Finding::of_fields(FindingKind::NoFields, Vec::new(), what.to_owned()));
    }
    findings
}

pub(super) fn small(fields: &[Field]) -> Option<Finding> {
    let small: Vec<&Field> = fields.iter().filter(|field| field.members.len() < FEW).collect();
    let least = small.iter().min_by_key(|field| field.members.len())?;
    let names: Vec<String> = small.iter().map(|field| field.name.clone()).collect();
    let fields = count(names.len(), "field");
    let what = format!("{fields} with under {FEW} taxels, too few for orientation: {}", listed(&names));
    let place = Some(format!("field `{}`", least.name));
    let worst = Some(least.members.len() as f64);
    Some(Finding { worst, place, ..Finding::of_fields(FindingKind::SmallField, names, what) })
}

pub(super) fn unused(body: &Body, fields: &[Field]) -> Option<Finding> {
    if fields.is_empty() {
        return None;
    }
    let mut held = vec![false; body.taxels.len()];
    fields.iter().flat_map(|field| &field.members).for_each(|member| held[member.taxel] = true);
    let loose: Vec<u32> = body.taxels.iter().zip(held).filter(|(_, held)| !held).map(|(taxel, _)| taxel.id).collect();
    if loose.is_empty() {
        return None;
    }
    let taxels = count(loose.len(), "taxel");
    let what = format!("{taxels} in no field, so that nothing is felt there: {}", listed(&loose));
    Some(Finding::of_taxels(FindingKind::UnusedTaxel, loose, what))
}

/// Taxels at one place, and taxels far from all others.
pub(super) fn crowding(body: &Body) -> Vec<Finding> {
    let places: Vec<DVec3> = body
        .taxels
        .iter()
        .map(|taxel| body.links[taxel.link].world_from_link.transform_point3(taxel.position_in_link))
        .collect();
    let tree = RTree::bulk_load(places.iter().enumerate().map(|(i, p)| GeomWithData::new(p.to_array(), i)).collect());
    let mut coincident: BTreeMap<u32, u32> = BTreeMap::new();
    let mut gaps: Vec<(f64, usize)> = Vec::new();
    for (index, place) in places.iter().enumerate() {
        let others =
            tree.nearest_neighbor_iter_with_distance_2(place.to_array()).filter(|(other, _)| other.data != index);
        // Enough of them to see past a few at one place.
        for (other, squared) in others.take(16) {
            if squared > ONE_PLACE_M * ONE_PLACE_M {
                gaps.push((squared.sqrt(), index));
                break;
            }
            // What measures something else may well sit there too.
            let (one, other) = (&body.taxels[index], &body.taxels[other.data]);
            if one.modality == other.modality {
                coincident.entry(one.id).or_insert(other.id);
            }
        }
    }
    let mut findings = Vec::new();
    if !coincident.is_empty() {
        let ids: Vec<u32> = coincident.keys().copied().collect();
        let what = format!("{} at the place of another: {}", count(ids.len(), "taxel"), listed(&ids));
        let first = body.taxel_index(ids[0]).map(|index| place(body, &body.taxels[index]));
        findings.push(Finding { place: first, ..Finding::of_taxels(FindingKind::CoincidentTaxels, ids, what) });
    }
    gaps.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some(&(usual, _)) = gaps.get(gaps.len() / 2) else { return findings };
    let far = &gaps[gaps.partition_point(|&(gap, _)| gap <= ISOLATED * usual)..];
    if let Some(&(gap, index)) = far.last() {
        let mut ids: Vec<u32> = far.iter().map(|&(_, index)| body.taxels[index].id).collect();
        ids.sort_unstable();
        let what = format!(
            "{} over {ISOLATED} times as far from any other as is usual, {:.1} mm: {}; farthest {}, {:.1} mm",
            count(ids.len(), "taxel"),
            usual * 1e3,
            listed(&ids),
            place(body, &body.taxels[index]),
            gap * 1e3
        );
        let (worst, place) = (Some(gap), Some(place(body, &body.taxels[index])));
        findings.push(Finding { worst, place, ..Finding::of_taxels(FindingKind::IsolatedTaxel, ids, what) });
    }
    findings
}

/// How a taxel stands to the surface beneath it.
pub(in super::super) struct Footing {
    /// Distance from the surface, m.
    pub(in super::super) off_m: f64,
    /// Angle of its normal with the nearest triangle normal there, rad.
    pub(in super::super) tilt_rad: f64,
    /// The surface's normal, in the taxel's link.
    pub(in super::super) normal_in_link: DVec3,
}

impl Footing {
    pub(in super::super) fn of(body: &Body, ground: &Ground<'_>, taxel: &Taxel) -> Option<Self> {
        let world_from_link = body.links[taxel.link].world_from_link;
        let p = world_from_link.transform_point3(taxel.position_in_link);
        let normal = world_from_link.transform_vector3(taxel.normal_in_link);
        let hit = ground.nearest(taxel.link, p)?;
        // On an edge both sides are right.
        let around = ground.normals_at(taxel.link, hit.position).map(|normal_there| angle(normal, normal_there));
        let tilt_rad = around.fold(angle(normal, hit.normal), f64::min);
        let normal_in_link = world_from_link.inverse().transform_vector3(hit.normal);
        Some(Self { off_m: hit.position.distance(p), tilt_rad, normal_in_link })
    }

    /// Whether the normal is no more what the surface gives.
    pub(in super::super) fn is_stale(&self) -> bool {
        self.tilt_rad > CURRENT_RAD
    }
}

/// The angle between two unit vectors; by the sine too, as the cosine of a small one says nothing.
fn angle(a: DVec3, b: DVec3) -> f64 {
    libm::atan2(a.cross(b).length(), a.dot(b))
}

/// Taxels off the surface, with normals that point inward, and with normals that are not the surface's.
pub(super) fn against_surface(body: &Body) -> Vec<Finding> {
    let ground = Ground::of(body);
    if ground.is_empty() {
        return Vec::new();
    }
    let (mut off, mut inward, mut stale) = (Worst::default(), Worst::default(), Worst::default());
    for taxel in &body.taxels {
        let Some(footing) = Footing::of(body, &ground, taxel) else { continue };
        if footing.off_m > ground.tolerance_m() {
            off.take(taxel, footing.off_m);
        }
        if footing.tilt_rad > std::f64::consts::FRAC_PI_2 {
            inward.take(taxel, footing.tilt_rad);
        } else if footing.is_stale() {
            stale.take(taxel, footing.tilt_rad);
        }
    }
    let degrees = |angle: f64| format!("{:.3}°", angle.to_degrees());
    let length = |distance: f64| format!("{:.3} mm", distance * 1e3);
    [
        off.finding(body, FindingKind::OffSurface, "off the surface", &length),
        inward.finding(body, FindingKind::InwardNormal, "with a normal that points into the body", &degrees),
        stale.finding(body, FindingKind::StaleNormal, "with a normal that is not the surface's", &degrees),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Taxels with something the matter, and the one that has most of it.
#[derive(Default)]
struct Worst<'a> {
    ids: Vec<u32>,
    worst: Option<(f64, &'a Taxel)>,
}

impl<'a> Worst<'a> {
    fn take(&mut self, taxel: &'a Taxel, number: f64) {
        self.ids.push(taxel.id);
        if self.worst.is_none_or(|(most, _)| number > most) {
            self.worst = Some((number, taxel));
        }
    }

    fn finding(self, body: &Body, kind: FindingKind, what: &str, shown: &dyn Fn(f64) -> String) -> Option<Finding> {
        let (worst, taxel) = self.worst?;
        let place = place(body, taxel);
        let taxels = count(self.ids.len(), "taxel");
        let what = format!("{taxels} {what}: {}; most {place}, {}", listed(&self.ids), shown(worst));
        Some(Finding { worst: Some(worst), place: Some(place), ..Finding::of_taxels(kind, self.ids, what) })
    }
}

/// Fields whose stored (u, v) are not what laying the chart anew gives, or that can no longer have one.
pub(super) fn stale_charts(body: &Body) -> Option<Finding> {
    let mut unroller = Unroller::new(body);
    let mut stale: Vec<String> = Vec::new();
    let mut worst: Option<(f64, String)> = None;
    let geodesic = |spec: &&FieldSpec| spec.chart.is_some_and(|chart| chart.kind == ChartKind::Geodesic);
    for spec in body.fields.iter().filter(geodesic).filter(|_| !body.surfaces.is_empty()) {
        match drift(&mut unroller, spec) {
            Some(0.0) => continue,
            Some(most) if worst.as_ref().is_none_or(|(known, _)| most > *known) => {
                worst = Some((most, format!("field `{}`", spec.name)));
            }
            _ => {}
        }
        stale.push(spec.name.clone());
    }
    if stale.is_empty() {
        return None;
    }
    let by = worst.as_ref().map(|(most, place)| format!("; most {place}, {:.3} mm", most * 1e3)).unwrap_or_default();
    let fields = count(stale.len(), "field");
    let what = format!("{fields} with a geodesic chart that the surface does not give: {}{by}", listed(&stale));
    let (worst, place) = worst.unzip();
    Some(Finding { worst, place, ..Finding::of_fields(FindingKind::StaleChart, stale, what) })
}

/// How far the stored (u, v) of `spec`, which has a geodesic chart, lie from what the surface gives, m; 0 where all are
/// current, `None` where some are missing or the surface gives none.
pub(in super::super) fn drift(unroller: &mut Unroller<'_>, spec: &FieldSpec) -> Option<f64> {
    // A parent that lists no taxels of its own has nothing to be stale.
    if spec.members.is_empty() {
        return Some(0.0);
    }
    let anew = unroller.unroll(spec).ok()?;
    let mut most = 0.0;
    for (stored, current) in spec.members.values().zip(anew.members.values()) {
        let ([u, v], [x, y]) = (stored.uv?, current.uv?);
        let (off, distance) = (libm::hypot(u - x, v - y), libm::hypot(x, y));
        if off > CURRENT_M + CURRENT_PART * distance {
            most = f64::max(most, off);
        }
    }
    Some(most)
}
