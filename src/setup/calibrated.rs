//! The calibration of a run: the one that is named, or that comes with what is read.

use std::path::{Path, PathBuf};

use super::overlaid::{How, kinds_in, overlaid};
use super::{Setup, attached};
use crate::body::{Body, Modality};
use crate::bundled::MEETING_CALIBRATION;
use crate::error::{Error, Result};
use crate::limits::{self, MAX_TOML_BYTES};
use crate::signal::Calibration;
use crate::source::{SimulatedSource, SourceSpec};

impl Setup {
    /// The calibration that comes with what is read, as the text of a file, and what it comes with: a simulation and an export
    /// have one, and a recording may, which is used with its body.
    pub(crate) fn own_calibration(&self) -> Result<Option<(PathBuf, String)>> {
        match self.first_source()? {
            Some(SourceSpec::Sim(path)) => {
                let text = SimulatedSource::open(&path)?.calibration();
                return Ok(Some((path, text)));
            }
            Some(SourceSpec::Vendor(_)) => return self.export_calibration(),
            _ => {}
        }
        let Some(recording) = self.recording() else { return Ok(None) };
        Ok(attached::calibration(recording, &self.tell)?.map(|text| (recording.clone(), text)))
    }

    /// The text of the calibration that is used for `body`, and what it comes with: the named one, laid over the own one of an export or
    /// a recording. A simulation's own is replaced.
    pub(crate) fn calibration_text(&self, body: &Body) -> Result<Option<(PathBuf, String)>> {
        let Some(path) = &self.calibration else { return self.calibration_found() };
        let given = limits::read_to_string(path, MAX_TOML_BYTES).map_err(|e| Error::io(path, &e))?;
        Ok(Some((path.clone(), self.over_own(path, given, &kinds_in(body))?)))
    }

    /// The calibration where none is named: the one that comes with what is read, or with the bundled touch.
    fn calibration_found(&self) -> Result<Option<(PathBuf, String)>> {
        let is_meeting = self.sources.is_empty() && self.body.as_deref() == Some("sensing-hand");
        let bundled = || (PathBuf::from("sensing-hand.toml"), MEETING_CALIBRATION.to_owned());
        Ok(self.own_calibration()?.or_else(|| is_meeting.then(bundled)))
    }

    /// The calibration `given`, at `path`, laid over the one that comes with what is read, for `taxels`.
    fn over_own(&self, path: &Path, given: String, taxels: &[(u32, Modality)]) -> Result<String> {
        let Some((of, own)) = self.own_calibration()? else { return Ok(given) };
        let is_replaced = matches!(self.first_source()?, Some(SourceSpec::Sim(_)));
        let how = if is_replaced { How::Replaced } else { How::Laid };
        let laid = overlaid((&of, &own), (path, &given), taxels, how, &self.tell)?;
        Ok(if is_replaced { given } else { laid })
    }

    /// The calibration that is named, or that comes with what is read, for `body`, whose taxels have `ids`.
    pub(super) fn calibration_for(&self, body: &Body, ids: &[u32]) -> Result<Option<Calibration>> {
        let modality = |id: u32| body.taxel_index(id).map_or(Modality::default(), |index| body.taxels[index].modality);
        let taxels: Vec<(u32, Modality)> = ids.iter().map(|&id| (id, modality(id))).collect();
        let load = |path: &PathBuf| {
            let given = limits::read_to_string(path, MAX_TOML_BYTES).map_err(|e| Error::io(path, &e))?;
            // Alone first, so that what is wrong with the file has its line.
            let calibration = Calibration::parse_for(&given, &taxels).map_err(|e| e.at(path.display()))?;
            calibration.check_body(&body.name).map_err(|e| e.at(path.display()))?;
            let text = self.over_own(path, given, &taxels)?;
            Calibration::parse_for(&text, &taxels)
                .map_err(|e| e.at("laid over the calibration of what is read").at(path.display()))
        };
        let parse = |(path, text): (PathBuf, String)| {
            Calibration::parse_for(&text, &taxels).map_err(|e| e.at("its own calibration").at(path.display()))
        };
        let calibration = match &self.calibration {
            Some(path) => Some(load(path)?),
            None => self.calibration_found()?.map(parse).transpose()?,
        };
        if let (Some(calibration), [source @ SourceSpec::Sim(_)]) = (&calibration, &self.sources[..]) {
            calibration.check_body(&body.name).map_err(|_| {
                let what =
                    format!("it is on another body than `{}`; leave `body` out, or change the simulation's", body.name);
                Error::usage(what).at(source)
            })?;
        }
        Ok(calibration)
    }
}
