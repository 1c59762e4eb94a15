//! The fields that a body gets without rules.

use std::collections::BTreeSet;

use super::grouper::Grouper;
use super::rule::{Each, FieldRule, Patches, Wrap};
use crate::error::{Error, Result};

/// Taxels of a patch without rules: enough for an orientation, few enough for a chart.
pub(super) const USUAL_TAXELS: usize = 12;

impl Grouper<'_> {
    /// Makes a field for each link, and below it patches of about [`USUAL_TAXELS`] taxels that have charts.
    ///
    /// # Errors
    /// There is no taxel.
    pub(crate) fn apply_usual(&mut self) -> Result<()> {
        let patches = Some(Patches::Of { of: USUAL_TAXELS, even: true });
        let rule = FieldRule { patches, wrap: Some(Wrap::Split), ..FieldRule::default() };
        let chosen = self.choose(&rule, None)?;
        if chosen.is_empty() {
            return Err(Error::failed("there is no taxel to make fields of"));
        }
        for (link, taxels) in self.group_by(Each::Link, &chosen).0 {
            let mut patches = self.even_patches(&taxels, USUAL_TAXELS);
            if patches.len() < 2 {
                self.add(&link, &self.with_other_kinds(taxels), &rule)?;
                continue;
            }
            // Its taxels are those of its patches; it need not have a chart.
            self.add(&link, &[], &FieldRule::default())?;
            let names = self.side_names(&patches);
            patches = self.join_other_kinds(patches);
            for (patch, taxels) in names.into_iter().zip(patches) {
                self.add(&format!("{link}/{patch}"), &taxels, &rule)?;
            }
        }
        Ok(())
    }

    /// `patches`, each also with the taxels that feel no pressure and are nearest to one of its taxels on the same link, on their own
    /// side of it if there is one: those of the other side of a thin shell may be nearer.
    fn join_other_kinds(&self, mut patches: Vec<Vec<usize>>) -> Vec<Vec<usize>> {
        let body = self.body;
        let of_link: BTreeSet<usize> = patches.iter().flatten().map(|&taxel| body.taxels[taxel].link).collect();
        let pressed: BTreeSet<usize> = patches.iter().flatten().copied().collect();
        let is_other = |taxel: &usize| {
            let own = &body.taxels[*taxel];
            !own.modality.is_pressed() && of_link.contains(&own.link) && !pressed.contains(taxel)
        };
        let others: Vec<usize> = (0..body.taxels.len()).filter(is_other).collect();
        let joined = others.into_iter().filter_map(|other| {
            let own = &body.taxels[other];
            let apart = |&taxel: &usize| body.taxels[taxel].position_in_link.distance_squared(own.position_in_link);
            let is_behind = |&taxel: &usize| body.taxels[taxel].normal_in_link.dot(own.normal_in_link) < 0.0;
            let nearest = |patch: &Vec<usize>| {
                let beside = patch.iter().filter(|&&taxel| body.taxels[taxel].link == own.link);
                let sided = beside.map(|taxel| (is_behind(taxel), apart(taxel)));
                sided.min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)))
            };
            let by_patch = patches.iter().enumerate().filter_map(|(index, patch)| Some((nearest(patch)?, index)));
            let best = by_patch.min_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
            best.map(|(_, patch)| (patch, other))
        });
        for (patch, other) in joined.collect::<Vec<_>>() {
            patches[patch].push(other);
        }
        patches.iter_mut().for_each(|patch| patch.sort_unstable());
        patches
    }

    fn with_other_kinds(&self, taxels: Vec<usize>) -> Vec<usize> {
        self.join_other_kinds(vec![taxels]).pop().unwrap_or_default()
    }
}
