//! A rule's children: one per link, mesh or material, patches, discs, rows, columns.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::distances::LinkDistances;
use super::even::even_patches;
use super::grouper::Grouper;
use super::patches::{patches, spread};
use super::rule::{Each, FieldRule, Patches, Rows, Seeds};
use crate::error::{Result, failed};
use crate::field::unions;

const MAX_ROUNDS: usize = 12;

/// Children: name and indices of taxels in the body.
type Children = Vec<(String, Vec<usize>)>;

enum Seed {
    Taxel(usize),
    /// In the body at rest, m.
    Point(DVec3),
}

impl Grouper<'_> {
    /// The children that `rule` makes of `chosen`; none if it does not divide.
    pub(super) fn divide(&mut self, rule: &FieldRule, chosen: &[usize]) -> Result<Children> {
        let stem = |default: &str| rule.stem.clone().unwrap_or(default.to_owned());
        if let Some(each) = rule.each {
            let (children, nameless) = self.group_by(each, chosen);
            if nameless > 0 {
                let what = self.rule_name(rule);
                let without = match each {
                    Each::Link => "link",
                    Each::Mesh => "mesh",
                    Each::Material => "material",
                };
                self.notes.push(format!(
                    "{what}: {nameless} taxels have no {without} and are in none of its fields; write another [[fields]] for \
                     them"
                ));
            }
            return Ok(children);
        }
        if let Some(wanted) = rule.patches {
            let count = match wanted {
                Patches::Number(number) => number,
                Patches::Of { of, even: true } => {
                    let patches = self.even_patches(chosen, of);
                    return Ok(self.named(rule, patches));
                }
                Patches::Of { of, .. } => chosen.len().div_ceil(of),
            };
            // No patch is empty.
            let patches = self.patches(chosen, count.min(chosen.len()), MAX_ROUNDS);
            if patches.len() != count && matches!(wanted, Patches::Number(_)) {
                let what = self.rule_name(rule);
                self.notes.push(format!(
                    "{what}: {} patches instead of {count}, as a patch keeps to one link and one connected part of the \
                     surface; choose fewer links, or another number",
                    patches.len()
                ));
            }
            return Ok(self.named(rule, patches));
        }
        if rule.radius.is_some() || rule.seeds.is_some() {
            let discs = self.discs(rule, chosen)?;
            return Ok(numbered(&stem("disc"), discs));
        }
        if let Some(rows) = rule.rows {
            return Ok(self.runs(chosen, rows, &stem("row"), true));
        }
        if let Some(columns) = rule.columns {
            return Ok(self.runs(chosen, columns, &stem("column"), false));
        }
        Ok(Vec::new())
    }

    /// `patches` by the stem that `rule` gives, or by the sides that they are on.
    fn named(&self, rule: &FieldRule, patches: Vec<Vec<usize>>) -> Children {
        match &rule.stem {
            Some(stem) => numbered(stem, patches),
            None => self.side_names(&patches).into_iter().zip(patches).collect(),
        }
    }

    fn rule_name(&self, rule: &FieldRule) -> String {
        rule.name.as_ref().map_or("a rule without name".to_owned(), |name| format!("rule `{name}`"))
    }

    /// The distances between `chosen`, link by link.
    fn distances(&mut self, chosen: &[usize]) -> Vec<LinkDistances> {
        let body = self.body;
        let mut by_link: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for &taxel in chosen {
            by_link.entry(body.taxels[taxel].link).or_default().push(taxel);
        }
        let of_link = |(link, taxels): (usize, Vec<usize>)| {
            let point = |&taxel: &usize| (body.taxels[taxel].position_in_link, body.taxels[taxel].normal_in_link);
            let points = taxels.iter().map(point).collect();
            LinkDistances::new(self.unroller.surfaces().in_link(link), taxels, points)
        };
        by_link.into_iter().map(of_link).collect()
    }

    /// `chosen` in `count` patches, or more if they are on more links or surface parts, ordered by lowest id.
    pub(super) fn patches(&mut self, chosen: &[usize], count: usize, most_rounds: usize) -> Vec<Vec<usize>> {
        self.by_halves(chosen, |grouper, taxels| {
            let share = (count * taxels.len()).div_ceil(chosen.len().max(1));
            grouper.compact_patches(taxels, share, most_rounds)
        })
    }

    /// The patches that `divide` makes of `chosen`: in a mirrored layout, of those on the left, and of the images of those on the right.
    fn by_halves(
        &mut self,
        chosen: &[usize],
        mut divide: impl FnMut(&mut Self, &[usize]) -> Vec<Vec<usize>>,
    ) -> Vec<Vec<usize>> {
        let [left, right] = self.halves.split(chosen);
        if right.is_empty() {
            return divide(self, chosen);
        }
        let images = self.halves.images(&right);
        let mut patches = if left.is_empty() { Vec::new() } else { divide(self, &left) };
        let mirrored = if images == left { patches.clone() } else { divide(self, &images) };
        patches.extend(mirrored.iter().map(|patch| self.halves.images(patch)));
        sorted(patches)
    }

    fn compact_patches(&mut self, chosen: &[usize], count: usize, most_rounds: usize) -> Vec<Vec<usize>> {
        let mut links = self.distances(chosen);
        let bounded = *self.unroller.windows_left();
        links.iter_mut().for_each(|distances| distances.windows_left = bounded);
        let patches = patches(&mut links, count, most_rounds);
        if let Some(left) = self.unroller.windows_left() {
            *left = links.iter().filter_map(|distances| distances.windows_left).min().unwrap_or(*left);
        }
        self.note_approximate(&links);
        let taxels = |(link, patch): (usize, Vec<usize>)| patch.into_iter().map(|i| links[link].taxels[i]).collect();
        sorted(patches.into_iter().map(taxels).collect())
    }

    /// `chosen` in patches of about `of` taxels, equal in number on each link and surface part, ordered by lowest id.
    pub(super) fn even_patches(&mut self, chosen: &[usize], of: usize) -> Vec<Vec<usize>> {
        self.by_halves(chosen, |grouper, taxels| {
            let mut links = grouper.distances(taxels);
            let mut patches = Vec::new();
            for distances in &mut links {
                let of_link = even_patches(distances, of);
                let taxels = |patch: Vec<usize>| patch.into_iter().map(|i| distances.taxels[i]).collect();
                patches.extend(of_link.into_iter().map(taxels));
            }
            sorted(patches)
        })
    }

    /// Whether `chosen` are on parts of the surface that do not meet.
    pub(super) fn are_apart(&mut self, chosen: &[usize]) -> bool {
        self.distances(chosen).iter().any(LinkDistances::are_apart)
    }

    fn note_approximate(&mut self, links: &[LinkDistances]) {
        for distances in links.iter().filter(|distances| distances.is_approximate()) {
            let link = &self.body.links[self.body.taxels[distances.taxels[0]].link].name;
            let note = format!(
                "link `{link}`: distances are measured along edges or from taxel to taxel, as its surface is missing or too \
                 rough; add or smooth the mesh for exact ones"
            );
            if !self.notes.contains(&note) {
                self.notes.push(note);
            }
        }
    }

    /// The discs that `rule` makes of `chosen`.
    fn discs(&mut self, rule: &FieldRule, chosen: &[usize]) -> Result<Vec<Vec<usize>>> {
        let mut links = self.distances(chosen);
        // Neighbours at the distance d share 2r − d of 2r.
        let radius_m = rule.radius.map(|radius| radius.metres);
        let seeds: Vec<Seed> = match (&rule.seeds, rule.overlap, radius_m) {
            (Some(seeds), ..) => self.seeds(seeds, chosen)?,
            (None, Some(overlap), Some(radius_m)) => {
                let apart_m = 2.0 * radius_m * (1.0 - overlap);
                let spread = links.iter_mut().flat_map(|distances| {
                    spread(distances, apart_m).into_iter().map(|i| distances.taxels[i]).collect::<Vec<_>>()
                });
                let mut taxels: Vec<usize> = spread.collect();
                taxels.sort_unstable();
                taxels.into_iter().map(Seed::Taxel).collect()
            }
            _ => Vec::new(),
        };
        let mut discs = Vec::new();
        let located: Vec<_> = seeds.iter().map(|seed| self.locate_seed(seed, &links)).collect();
        for (number, &(link, nearest, at)) in located.iter().enumerate() {
            let distances = &mut links[link];
            let radius_m = match radius_m {
                Some(radius_m) => radius_m,
                None => {
                    let all = distances.all_from_taxel(nearest);
                    // A point counts as its nearest taxel.
                    let others = located.iter().enumerate().filter(|&(other, &(on, ..))| other != number && on == link);
                    let apart = others.map(|(_, &(_, i, _))| all[i].distance_m).filter(|&distance| distance > 0.0);
                    let least = apart.fold(f64::INFINITY, f64::min);
                    if least == f64::INFINITY {
                        return Err(failed!(
                            "seed {} has no other on its part of the surface to overlap with; give a `radius`",
                            number + 1
                        ));
                    }
                    least / (2.0 * (1.0 - rule.overlap.unwrap_or(0.0)))
                }
            };
            let locate = |(link, p)| self.unroller.surfaces().in_link(link).locate(p, distances.points[nearest].1);
            let reached = match at.and_then(locate) {
                Some(place) => distances.near_place(&place, nearest, radius_m),
                None => distances.near_taxel(nearest, radius_m),
            };
            let within = (0..distances.len()).filter(|&i| reached[i].distance_m <= radius_m);
            let disc: Vec<usize> = within.map(|i| distances.taxels[i]).collect();
            if disc.is_empty() {
                return Err(failed!(
                    "there is no taxel within {radius_m} m of seed {}; widen the `radius`, or move the seed",
                    number + 1
                ));
            }
            discs.push(disc);
        }
        self.note_approximate(&links);
        let held: BTreeSet<usize> = discs.iter().flatten().copied().collect();
        if held.len() < chosen.len() {
            let what = self.rule_name(rule);
            self.notes.push(format!(
                "{what}: {} taxels are in no disc; widen `radius`, or add seeds",
                chosen.len() - held.len()
            ));
        }
        Ok(discs)
    }

    /// The link of `links` that `seed` is on, the nearest taxel there, and the seed's place if it is not a taxel.
    fn locate_seed(&self, seed: &Seed, links: &[LinkDistances]) -> (usize, usize, Option<(usize, DVec3)>) {
        let body = self.body;
        let on = |p: DVec3, distances: &LinkDistances| {
            body.links[body.taxels[distances.taxels[0]].link].body_from_link.inverse().transform_point3(p)
        };
        match *seed {
            Seed::Taxel(taxel) => {
                let find = |(link, distances): (usize, &LinkDistances)| {
                    Some((link, distances.taxels.iter().position(|&t| t == taxel)?, None))
                };
                links.iter().enumerate().find_map(find).unwrap_or((0, 0, None))
            }
            Seed::Point(p) => {
                let all = links.iter().enumerate().flat_map(|(link, distances)| {
                    let p = on(p, distances);
                    (0..distances.len()).map(move |i| (link, i, p, distances.points[i].0.distance_squared(p)))
                });
                let nearest = all.min_by(|a, b| a.3.total_cmp(&b.3));
                let (link, i, p, _) = nearest.unwrap_or((0, 0, p, 0.0));
                (link, i, Some((body.taxels[links[link].taxels[i]].link, p)))
            }
        }
    }

    fn seeds(&self, seeds: &Seeds, chosen: &[usize]) -> Result<Vec<Seed>> {
        let body = self.body;
        match seeds {
            Seeds::Points(points) => Ok(points.iter().map(|&p| Seed::Point(DVec3::from_array(p))).collect()),
            Seeds::Ids(lists) => {
                let ids = lists.iter().flat_map(|ids| ids.first..=ids.last);
                let mut taxels = Vec::new();
                for id in ids {
                    let taxel = body.taxel_index(id).filter(|taxel| chosen.binary_search(taxel).is_ok());
                    let why = || failed!("`seeds`: taxel {id} is not among those that the rule chooses");
                    taxels.push(Seed::Taxel(taxel.ok_or_else(why)?));
                    if taxels.len() > chosen.len() {
                        return Err(failed!("`seeds`: it lists a taxel twice; list each once"));
                    }
                }
                Ok(taxels)
            }
            Seeds::Fields(globs) => {
                let specs: Vec<_> = self.made.iter().map(|made| made.spec.clone()).collect();
                let named = specs.iter().zip(unions(&specs)).filter(|(spec, _)| globs.matches(&spec.name));
                let chosen_of = |ids: BTreeSet<u32>| -> Vec<usize> {
                    let taxels = ids.into_iter().filter_map(|id| body.taxel_index(id));
                    taxels.filter(|taxel| chosen.binary_search(taxel).is_ok()).collect()
                };
                let middles = named.filter_map(|(_, ids)| self.middle(&chosen_of(ids)));
                let middles: Vec<Seed> = middles.map(Seed::Taxel).collect();
                if middles.is_empty() {
                    let asked = globs.listed();
                    return Err(failed!("`seeds`: no field that matches `{asked}` has a chosen taxel"));
                }
                Ok(middles)
            }
        }
    }

    /// The taxel nearest to the mean of `taxels`, preferably with a normal like theirs.
    fn middle(&self, taxels: &[usize]) -> Option<usize> {
        let at = |taxel: usize| {
            let taxel = &self.body.taxels[taxel];
            let body_from_link = self.body.links[taxel.link].body_from_link;
            (
                body_from_link.transform_point3(taxel.position_in_link),
                body_from_link.transform_vector3(taxel.normal_in_link),
            )
        };
        let points: Vec<(DVec3, DVec3)> = taxels.iter().map(|&taxel| at(taxel)).collect();
        let mean = points.iter().map(|(p, _)| *p).sum::<DVec3>() / points.len() as f64;
        let facing = points.iter().map(|(_, normal)| *normal).sum::<DVec3>().normalize_or_zero();
        let off = |i: usize| points[i].0.distance(mean) * (2.0 - points[i].1.dot(facing));
        (0..taxels.len()).min_by(|&a, &b| off(a).total_cmp(&off(b))).map(|i| taxels[i])
    }

    /// Rows of ids, or columns if `by_row` is false.
    fn runs(&self, chosen: &[usize], rows: Rows, stem: &str, by_row: bool) -> Children {
        let id = |taxel: usize| self.body.taxels[taxel].id;
        let first = rows.first.or(chosen.iter().map(|&taxel| id(taxel)).min()).unwrap_or(0);
        let stride = rows.stride.unwrap_or(rows.of);
        let mut runs: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for &taxel in chosen.iter().filter(|&&taxel| id(taxel) >= first) {
            let (row, column) = ((id(taxel) - first) / stride, (id(taxel) - first) % stride);
            if column < rows.of {
                runs.entry(if by_row { row } else { column }).or_default().push(taxel);
            }
        }
        let width = width_of(runs.keys().last().map_or(0, |&last| last as usize + 1));
        // Empty rows count.
        runs.into_iter().map(|(run, taxels)| (format!("{stem}_{:0width$}", run + 1), taxels)).collect()
    }
}

/// `patches` with their taxels in order, ordered by their first.
fn sorted(mut patches: Vec<Vec<usize>>) -> Vec<Vec<usize>> {
    patches.iter_mut().for_each(|patch| patch.sort_unstable());
    patches.sort_by_key(|patch| patch[0]);
    patches
}

/// Children numbered from 1 with a fixed number of digits.
pub(super) fn numbered(stem: &str, lists: Vec<Vec<usize>>) -> Children {
    let width = width_of(lists.len());
    lists.into_iter().zip(1..).map(|(taxels, number)| (format!("{stem}_{number:0width$}"), taxels)).collect()
}

/// Digits of the largest number, at least two.
fn width_of(largest: usize) -> usize {
    largest.to_string().len().max(2)
}
