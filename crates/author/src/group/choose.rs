//! Selects the taxels of a rule.

use std::collections::{BTreeMap, BTreeSet};

use super::grouper::Grouper;
use super::rule::{Each, FieldRule};
use crate::error::{Error, Result, failed, suggestion};
use crate::field::LinkSurface;
use crate::recipe_values::{Globs, Ids};

/// A taxel is selected if the attribute is above this.
const PAINTED: f64 = 0.5;

/// The place of a taxel: a surface of its body, a triangle of it, and the weights of the triangle's corners.
type TaxelPlace = (usize, usize, [f64; 3]);

impl Grouper<'_> {
    /// The taxels of `among`, indices into the body's taxels, ascending, or of all taxels, that `rule` selects.
    pub(super) fn choose(&mut self, rule: &FieldRule, among: Option<&[usize]>) -> Result<Vec<usize>> {
        let mut chosen = match &rule.taxels {
            None => among.map_or_else(|| (0..self.body.taxels.len()).collect(), <[usize]>::to_vec),
            Some(lists) => {
                let mut listed = self.listed(lists)?;
                listed.retain(|taxel| among.is_none_or(|among| among.binary_search(taxel).is_ok()));
                listed
            }
        };
        self.keep_modality(rule, &mut chosen)?;
        if let Some(globs) = &rule.link {
            let carrying: BTreeSet<&str> =
                self.body.taxels.iter().map(|t| self.body.links[t.link].name.as_str()).collect();
            known("link", globs, "link that carries taxels", carrying.iter().copied())?;
            chosen.retain(|&taxel| globs.matches(&self.body.links[self.body.taxels[taxel].link].name));
        }
        if let Some(globs) = &rule.mesh {
            known("mesh", globs, "node that shows a mesh", self.body.surfaces.iter().map(|s| s.name.as_str()))?;
            let body = self.body;
            chosen
                .retain(|&taxel| self.taxel_place(taxel).is_some_and(|(s, ..)| globs.matches(&body.surfaces[s].name)));
        }
        let painted = self.painted;
        if let Some(globs) = &rule.material {
            let names = painted.materials();
            known("material", globs, "material", names.iter().map(String::as_str))?;
            chosen.retain(|&taxel| {
                self.taxel_place(taxel)
                    .and_then(|(s, t, _)| painted.material(s, t))
                    .is_some_and(|name| globs.matches(name))
            });
        }
        if let Some(name) = &rule.attribute {
            let names = painted.attributes();
            if !names.contains(name) {
                return Err(unknown("attribute", name, "painted attribute", names.iter().map(String::as_str)));
            }
            chosen.retain(|&taxel| {
                let taxel_place = self.taxel_place(taxel);
                let value = taxel_place.and_then(|(s, t, barycentric)| painted.attribute(name, s, t, barycentric));
                value.is_some_and(|value| value > PAINTED)
            });
        }
        Ok(chosen)
    }

    /// The taxels with the ids in `lists`, as indices into the body's taxels, ascending. Each list has at least one.
    pub(super) fn listed(&self, lists: &[Ids]) -> Result<Vec<usize>> {
        let taxels = &self.body.taxels;
        let mut ranges = Vec::with_capacity(lists.len());
        for Ids { first, last } in lists {
            // They are sorted by id.
            let range = taxels.partition_point(|t| t.id < *first)..taxels.partition_point(|t| t.id <= *last);
            if range.is_empty() {
                let span = match &taxels[..] {
                    [first, .., last] => format!("its ids are from {} to {}", first.id, last.id),
                    few => format!("it has {}", few.len()),
                };
                return Err(failed!("`taxels`: the body has no taxel from {first} to {last}; {span}"));
            }
            ranges.push((range.start, range.end));
        }
        // Ranges that overlap give each taxel once.
        ranges.sort_unstable();
        let mut end = 0;
        let fresh = ranges.into_iter().flat_map(|(from, to)| {
            let fresh = from.max(end)..to.max(end);
            end = fresh.end;
            fresh
        });
        Ok(fresh.collect())
    }

    /// Keeps the taxels of the rule's modality; by default pressure taxels if there are any, unless the rule lists ids.
    fn keep_modality(&self, rule: &FieldRule, chosen: &mut Vec<usize>) -> Result<()> {
        let modality = |taxel: usize| self.body.taxels[taxel].modality;
        if let Some(wanted) = &rule.modality {
            let names: BTreeSet<String> = self.body.taxels.iter().map(|t| t.modality.name()).collect();
            if !names.contains(wanted) {
                return Err(unknown("modality", wanted, "modality of its taxels", names.iter().map(String::as_str)));
            }
            chosen.retain(|&taxel| modality(taxel).name() == *wanted);
        } else if rule.taxels.is_none() && chosen.iter().any(|&taxel| modality(taxel).is_pressed()) {
            chosen.retain(|&taxel| modality(taxel).is_pressed());
        }
        Ok(())
    }

    fn taxel_place(&mut self, taxel: usize) -> Option<TaxelPlace> {
        let (body, unroller) = (self.body, &mut self.unroller);
        *self.taxel_places.entry(taxel).or_insert_with(|| {
            let taxel = &body.taxels[taxel];
            let surface: &LinkSurface = &unroller.surfaces().in_link(taxel.link);
            let place = surface.locate(taxel.position_in_link, taxel.normal_in_link)?;
            Some(surface.origin_of(&place))
        })
    }

    /// Groups `chosen` by the names that `each` requests, in the order of the names' first taxels. Also returns the number of
    /// taxels without such a name.
    pub(super) fn group_by(&mut self, each: Each, chosen: &[usize]) -> (Vec<(String, Vec<usize>)>, usize) {
        let (body, painted) = (self.body, self.painted);
        let mut order: Vec<(String, Vec<usize>)> = Vec::new();
        let mut place_of: BTreeMap<String, usize> = BTreeMap::new();
        let mut nameless = 0;
        for &taxel in chosen {
            let name = match each {
                Each::Link => Some(self.link_names[body.taxels[taxel].link].clone()),
                Each::Mesh => self.taxel_place(taxel).map(|(s, ..)| body.surfaces[s].name.clone()),
                Each::Material => {
                    self.taxel_place(taxel).and_then(|(s, t, _)| painted.material(s, t)).map(str::to_owned)
                }
            };
            let Some(name) = name else {
                nameless += 1;
                continue;
            };
            // A slash would add a level.
            let name = name.replace('/', "_");
            let place = *place_of.entry(name).or_insert_with_key(|name| {
                order.push((name.clone(), Vec::new()));
                order.len() - 1
            });
            order[place].1.push(taxel);
        }
        (order, nameless)
    }
}

/// An error where no glob of `key` matches any of `names`.
fn known<'n>(key: &str, globs: &Globs, thing: &str, names: impl Iterator<Item = &'n str> + Clone) -> Result<()> {
    if names.clone().any(|name| globs.matches(name)) {
        return Ok(());
    }
    Err(unknown(key, &globs.listed(), thing, names))
}

/// The error that `key` matches no `thing` of `names`.
fn unknown<'n>(key: &str, asked: &str, thing: &str, names: impl Iterator<Item = &'n str>) -> Error {
    failed!("`{key}`: no {thing} matches `{asked}`; {}", suggestion(asked, names))
}
