//! Taxels that are too near to others, or too far from them, for the region that they are in.
//!
//! The region of a taxel is what is around it: the dozen nearest taxels of its link that measure the same and face about as it does. How
//! far each of these is from its own nearest is what is usual there. So neither a fine hand on a coarse body has findings, nor a fine
//! patch on a coarse link.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::super::placed::COINCIDENT_M;
use super::finding::{Finding, FindingKind, count, place};
use crate::body::{Body, PointTree, listed, point_tree};

/// Taxels of a region, at least and at most.
const MIN_REGION: usize = 3;
const REGION: usize = 12;

/// Nearest taxels that are looked through for a region.
const MAX_CANDIDATES: usize = 64;

/// Two taxels are crowded up to this share of what is usual in their region, with a margin for rounding.
const CROWDED_SHARE: f64 = 0.2 * (1.0 + 1e-3);

/// A taxel is isolated if its nearest neighbour is over this many times what is usual in its region away.
const ISOLATED_RATIO: f64 = 5.0;

/// It is not if at least `AS_FAR` others within `AS_FAR_WITHIN` times that distance are over `AS_FAR_SHARE` as far from their nearest:
/// a coarse part begins there.
const AS_FAR: usize = 3;
const AS_FAR_WITHIN: f64 = 3.0;
const AS_FAR_SHARE: f64 = 0.5;

/// Nearest taxels among which one at another place is looked for.
const MAX_COINCIDENT: usize = 16;

/// Taxels at one place, too near to each other, and too far from all others.
pub(super) fn findings(body: &Body) -> Vec<Finding> {
    let spacing = Spacing::from_body(body);
    let mut findings = Vec::new();
    findings.extend(spacing.coincident());
    findings.extend(spacing.crowded());
    findings.extend(spacing.isolated());
    findings
}

/// Taxels of one link that measure the same.
struct Alike {
    /// Indices.
    taxels: Vec<usize>,
    tree: PointTree,
}

struct Spacing<'a> {
    body: &'a Body,
    /// In the body at rest, m.
    places: Vec<DVec3>,
    normals: Vec<DVec3>,
    tree: PointTree,
    /// Per taxel the distance to the nearest at another place, of any link and modality, m.
    gaps_m: Vec<f64>,
    alike: Vec<Alike>,
    /// Per taxel which of `alike` it is in.
    of: Vec<usize>,
    /// Per taxel its nearest in `alike` that faces about as it does, and how far it is, m.
    nearest: Vec<Option<(usize, f64)>>,
}

impl<'a> Spacing<'a> {
    fn from_body(body: &'a Body) -> Self {
        let in_body = |taxel: usize| body.links[body.taxels[taxel].link].body_from_link;
        let all = || 0..body.taxels.len();
        let places: Vec<DVec3> =
            all().map(|taxel| in_body(taxel).transform_point3(body.taxels[taxel].position_in_link)).collect();
        let normals = all().map(|taxel| in_body(taxel).transform_vector3(body.taxels[taxel].normal_in_link)).collect();
        let tree = point_tree(places.iter().copied());
        let mut grouped: BTreeMap<(usize, u32), Vec<usize>> = BTreeMap::new();
        for (index, taxel) in body.taxels.iter().enumerate() {
            grouped.entry((taxel.link, taxel.modality.code())).or_default().push(index);
        }
        let mut of = vec![0; body.taxels.len()];
        for (group, taxels) in grouped.values().enumerate() {
            taxels.iter().for_each(|&taxel| of[taxel] = group);
        }
        let alike = grouped.into_values().map(|taxels| {
            let tree = point_tree(taxels.iter().map(|&taxel| places[taxel]));
            Alike { taxels, tree }
        });
        let alike = alike.collect();
        let mut spacing = Self { body, places, normals, tree, gaps_m: Vec::new(), alike, of, nearest: Vec::new() };
        spacing.gaps_m = all().map(|taxel| spacing.gap(taxel)).collect();
        spacing.nearest = all().map(|taxel| spacing.around(taxel).next()).collect();
        spacing
    }

    fn gap(&self, taxel: usize) -> f64 {
        let near = self.tree.nearest_neighbor_iter_with_distance_2(self.places[taxel].to_array());
        let apart = near.take(MAX_COINCIDENT + 1).find(|(_, squared)| *squared > COINCIDENT_M * COINCIDENT_M);
        apart.map_or(0.0, |(_, squared)| squared.sqrt())
    }

    /// The taxels like `taxel` around it at other places, and how far they are, m; the nearest first.
    fn around(&self, taxel: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let alike = &self.alike[self.of[taxel]];
        let near = alike.tree.nearest_neighbor_iter_with_distance_2(self.places[taxel].to_array());
        let near = near.take(MAX_CANDIDATES).map(|(spot, squared)| (alike.taxels[spot.data], squared.sqrt()));
        near.filter(move |&(other, distance_m)| {
            other != taxel && distance_m > COINCIDENT_M && self.normals[other].dot(self.normals[taxel]) > 0.0
        })
    }

    /// What is usual around `taxel`, without `partner`, m; `None` if too few are there.
    fn usual(&self, taxel: usize, partner: Option<usize>) -> Option<f64> {
        let region = self.around(taxel).map(|(other, _)| other).filter(|other| Some(*other) != partner).take(REGION);
        let mut gaps: Vec<f64> = region.filter_map(|other| self.nearest[other]).map(|(_, gap_m)| gap_m).collect();
        gaps.sort_by(f64::total_cmp);
        (gaps.len() >= MIN_REGION).then(|| gaps[gaps.len() / 2])
    }

    fn id(&self, taxel: usize) -> u32 {
        self.body.taxels[taxel].id
    }

    /// Taxels at the place of another of their modality: others may share one.
    fn coincident(&self) -> Option<Finding> {
        let mut ids: BTreeSet<u32> = BTreeSet::new();
        for (index, taxel) in self.body.taxels.iter().enumerate() {
            let near = self.tree.nearest_neighbor_iter_with_distance_2(self.places[index].to_array());
            let here = near.take(MAX_COINCIDENT + 1).take_while(|(_, squared)| *squared <= COINCIDENT_M * COINCIDENT_M);
            let mut others = here.map(|(spot, _)| spot.data).filter(|&other| other != index);
            if others.any(|other| self.body.taxels[other].modality == taxel.modality) {
                ids.insert(taxel.id);
            }
        }
        let ids: Vec<u32> = ids.into_iter().collect();
        let first = self.body.taxel_index(*ids.first()?).map(|index| place(self.body, &self.body.taxels[index]));
        let what = format!("{} at the place of another: {}", count(ids.len(), "taxel"), listed(&ids));
        Some(Finding { place: first, ..Finding::of_taxels(FindingKind::CoincidentTaxels, ids, what) })
    }

    /// Taxels that are much nearer to another than is usual around the two.
    fn crowded(&self) -> Option<Finding> {
        let mut ids: BTreeSet<u32> = BTreeSet::new();
        let mut worst: Option<(f64, f64, usize)> = None;
        for (taxel, nearest) in self.nearest.iter().enumerate() {
            let Some((other, gap_m)) = *nearest else { continue };
            let Some(usual_m) = self.usual(taxel, Some(other)) else { continue };
            if gap_m > CROWDED_SHARE * usual_m {
                continue;
            }
            ids.extend([self.id(taxel), self.id(other)]);
            if worst.is_none_or(|(gap, usual, _)| gap_m / usual_m < gap / usual) {
                worst = Some((gap_m, usual_m, taxel));
            }
        }
        let (gap_m, usual_m, taxel) = worst?;
        let ids: Vec<u32> = ids.into_iter().collect();
        let place = place(self.body, &self.body.taxels[taxel]);
        let what = format!(
            "{} nearer to another than a fifth of what is usual around them: {}; nearest {place}, {:.2} mm where {:.1} mm is usual",
            count(ids.len(), "taxel"),
            listed(&ids),
            gap_m * 1e3,
            usual_m * 1e3
        );
        let (worst, place) = (Some(gap_m), Some(place));
        Some(Finding { worst, place, ..Finding::of_taxels(FindingKind::CrowdedTaxels, ids, what) })
    }

    /// Taxels that are much farther from any other than is usual around them.
    fn isolated(&self) -> Option<Finding> {
        let mut ids = Vec::new();
        let mut worst: Option<(f64, f64, usize)> = None;
        for (taxel, &gap_m) in self.gaps_m.iter().enumerate() {
            let Some(usual_m) = self.usual(taxel, None) else { continue };
            if gap_m <= ISOLATED_RATIO * usual_m || self.is_in_coarse_part(taxel, gap_m) {
                continue;
            }
            ids.push(self.id(taxel));
            if worst.is_none_or(|(gap, ..)| gap_m > gap) {
                worst = Some((gap_m, usual_m, taxel));
            }
        }
        let (gap_m, usual_m, taxel) = worst?;
        ids.sort_unstable();
        let place = place(self.body, &self.body.taxels[taxel]);
        let what = format!(
            "{} over {ISOLATED_RATIO} times as far from any other as is usual around them: {}; farthest {place}, {:.1} mm where {:.1} \
             mm is usual",
            count(ids.len(), "taxel"),
            listed(&ids),
            gap_m * 1e3,
            usual_m * 1e3
        );
        let (worst, place) = (Some(gap_m), Some(place));
        Some(Finding { worst, place, ..Finding::of_taxels(FindingKind::IsolatedTaxel, ids, what) })
    }

    /// Whether others near `taxel` are about as far from their nearest as it is.
    fn is_in_coarse_part(&self, taxel: usize, gap_m: f64) -> bool {
        let alike = &self.alike[self.of[taxel]];
        let reach = (AS_FAR_WITHIN * gap_m).powi(2);
        let near = alike.tree.locate_within_distance(self.places[taxel].to_array(), reach);
        let others = near.map(|spot| alike.taxels[spot.data]).filter(|&other| other != taxel);
        others.filter(|&other| self.gaps_m[other] > AS_FAR_SHARE * gap_m).take(AS_FAR).count() == AS_FAR
    }
}
