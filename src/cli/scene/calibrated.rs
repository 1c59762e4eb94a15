//! The calibration of a run, and the outputs that it can give.

use std::path::{Path, PathBuf};

use somatic::limits::{self, MAX_TOML_BYTES};
use somatic::scene::AskedOutputs;
use somatic::signal::Quantity;
use somatic::sink::TableWish;
use somatic::source::{SimulatedSource, SourceSpec};
use somatic::{Body, Calibration, Error, Outputs, Receptor, Result, touch};

use super::RunOptions;
use crate::cli::attached;
use crate::cli::overlaid::{How, overlaid};

impl RunOptions {
    /// The outputs that are asked for; if none are, those that `calibration` and what is read can give.
    pub(super) fn outputs_with(&self, calibration: Option<&Calibration>) -> Result<Outputs> {
        if !self.outputs.is_empty() {
            return Ok(self.outputs());
        }
        let has_unit =
            |calibration: &Calibration| calibration.taxels.iter().any(|taxel| taxel.quantity != Quantity::Count);
        let is_placed = self.body.is_some() || self.export_is_placed()?.unwrap_or(true);
        Ok(match (is_placed, calibration.is_some_and(has_unit)) {
            // Of sensors of which nobody says where they are.
            (false, _) => Outputs::TOTAL | Outputs::PEAK | Outputs::ACTIVE,
            (true, true) => self.outputs() | Outputs::FORCE,
            (true, false) => self.outputs(),
        })
    }

    /// What is asked of touches of the whole body; `None` looks for none.
    pub(in crate::cli) fn touches(&self) -> Option<touch::Options> {
        let outputs = AskedOutputs::all_of(&self.outputs).of_touches?;
        // Nobody has asked for them, and there are no pressures to find them in.
        let is_in_vain =
            self.outputs.is_empty() && !self.letters.is_empty() && !self.letters.contains(&Receptor::Sustained);
        (!is_in_vain).then(|| self.touch.unwrap_or_default().options(outputs))
    }

    /// What tables have of that.
    pub(in crate::cli) fn tables(&self, wide: bool) -> TableWish {
        TableWish::new(self.outputs(), self.touches().is_some(), wide)
    }

    /// The calibration that comes with what is read, as the text of a file, and what it comes with: a simulation and an export
    /// have one, and a recording may, which is used with its body.
    pub(in crate::cli) fn own_calibration(&self) -> Result<Option<(PathBuf, String)>> {
        match self.first_source()? {
            Some(SourceSpec::Sim(path)) => {
                let text = SimulatedSource::open(&path)?.calibration();
                return Ok(Some((path, text)));
            }
            Some(SourceSpec::Vendor(_)) => return self.export_calibration(),
            _ => {}
        }
        let Some(recording) = self.recording()? else { return Ok(None) };
        Ok(attached::calibration(&recording, self.quiet)?.map(|text| (recording, text)))
    }

    /// The text of the calibration that is used, and what it comes with: the named one, laid over the own one of an export or
    /// a recording. A simulation's own is replaced.
    pub(in crate::cli) fn calibration_text(&self) -> Result<Option<(PathBuf, String)>> {
        let Some(path) = &self.calibration else { return self.own_calibration() };
        let given = limits::read_to_string(path, MAX_TOML_BYTES).map_err(|e| Error::io(path, &e))?;
        Ok(Some((path.clone(), self.over_own(path, given)?)))
    }

    /// The calibration `given`, at `path`, laid over the one that comes with what is read.
    fn over_own(&self, path: &Path, given: String) -> Result<String> {
        let Some((of, own)) = self.own_calibration()? else { return Ok(given) };
        let is_replaced = matches!(self.first_source()?, Some(SourceSpec::Sim(_)));
        let laid = overlaid(&of, &own, path, &given, if is_replaced { How::Replaced } else { How::Laid }, self.quiet)?;
        Ok(if is_replaced { given } else { laid })
    }

    /// The calibration that is named, or that comes with what is read, for `body`, whose taxels have `ids`.
    pub(super) fn calibration_for(&self, body: &Body, ids: &[u32]) -> Result<Option<Calibration>> {
        let load = |path: &PathBuf| {
            let given = limits::read_to_string(path, MAX_TOML_BYTES).map_err(|e| Error::io(path, &e))?;
            // Alone first, so that what is wrong with the file has its line.
            let calibration = Calibration::parse(&given, ids).map_err(|e| e.at(path.display()))?;
            calibration.check_body(&body.name).map_err(|e| e.at(path.display()))?;
            let text = self.over_own(path, given)?;
            Calibration::parse(&text, ids)
                .map_err(|e| e.at("laid over the calibration of what is read").at(path.display()))
        };
        let parse = |(path, text): (PathBuf, String)| {
            Calibration::parse(&text, ids).map_err(|e| e.at("its own calibration").at(path.display()))
        };
        let calibration = match &self.calibration {
            Some(path) => Some(load(path)?),
            None => self.own_calibration()?.map(parse).transpose()?,
        };
        if let (Some(calibration), [source]) = (&calibration, &self.sources[..])
            && source.starts_with("sim:")
        {
            calibration.check_body(&body.name).map_err(|_| {
                let what =
                    format!("it is on another body than `{}`; leave --body out, or change its key `body`", body.name);
                Error::usage(what).at(source)
            })?;
        }
        Ok(calibration)
    }
}
