//! The fields that a body gets without rules.

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
            let patches = self.even_patches(&taxels, USUAL_TAXELS);
            if patches.len() < 2 {
                self.add(&link, &taxels, &rule)?;
                continue;
            }
            // Its taxels are those of its patches; it need not have a chart.
            self.add(&link, &[], &FieldRule::default())?;
            for (patch, taxels) in self.side_names(&patches).into_iter().zip(patches) {
                self.add(&format!("{link}/{patch}"), &taxels, &rule)?;
            }
        }
        Ok(())
    }
}
