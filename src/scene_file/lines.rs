//! Boards on serial lines: what a scene says of them, and which lines they are.

use std::path::PathBuf;

use super::SceneFile;
use crate::error::{Error, Result};
use crate::signal::{Calibration, Response, Wiring};
use crate::source::SourceSpec;
#[cfg(feature = "serial")]
use crate::source::{SerialOptions, SerialSource};

/// How boards on serial lines are read.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct LineKeys {
    /// The TOML file that maps channels of boards to taxels.
    pub wiring: Option<PathBuf>,
    /// At which rate the boards' frames are merged, Hz; 0 is one for each frame of any board.
    pub live_rate_hz: Option<f64>,
    /// The rate at which boards shall send, Hz; 0 is as fast as the line allows.
    pub board_rate_hz: Option<f64>,
}

impl SceneFile {
    /// How boards on serial lines are read.
    #[must_use]
    pub fn line_keys(&self) -> LineKeys {
        LineKeys { wiring: self.wiring.clone(), live_rate_hz: self.live_rate_hz, board_rate_hz: self.board_rate_hz }
    }
}

impl LineKeys {
    /// The lines that `sources` name, each with its speed in baud where one is given; none where they are not serial lines.
    ///
    /// # Errors
    /// A usage error: sources of these kinds are not read together, or there are keys for lines and no lines.
    pub fn lines(&self, sources: &[SourceSpec]) -> Result<Vec<(String, Option<u32>)>> {
        let mut lines = Vec::new();
        let mut limbs = 0;
        for source in sources {
            match source {
                SourceSpec::Serial { port, baud } => lines.push((port.clone(), *baud)),
                SourceSpec::Zenoh(_) => limbs += 1,
                _ => {}
            }
        }
        let recordings = sources.iter().filter(|source| source.is_recording()).count();
        if sources.len() > 1 && ![lines.len(), limbs, recordings].contains(&sources.len()) {
            return Err(Error::usage(
                "only serial lines, only limbs, or only recordings are read together; run once for each of the others",
            ));
        }
        let of_lines = [
            ("wiring", self.wiring.is_some()),
            ("live_rate_hz", self.live_rate_hz.is_some() && limbs == 0),
            ("board_rate_hz", self.board_rate_hz.is_some()),
        ];
        match of_lines.iter().find(|(_, given)| *given && lines.is_empty()) {
            Some((key, _)) => {
                Err(Error::usage(format!("`{key}` is for boards on serial lines; add `source = \"serial:PORT\"`")))
            }
            None => Ok(lines),
        }
    }

    /// The map from channels of boards to taxels, if there is a file of it.
    ///
    /// # Errors
    /// There is no such file, or it is not a wiring.
    pub fn wiring(&self) -> Result<Option<Wiring>> {
        self.wiring.as_ref().map(Wiring::load).transpose()
    }

    /// Opens `lines` for a body whose taxels have `ids`, values being up to `max_age_s` old. Errors in the wiring
    /// name its file.
    ///
    /// # Errors
    /// A port cannot be opened, or the wiring does not fit.
    #[cfg(feature = "serial")]
    pub fn open(&self, lines: &[(String, Option<u32>)], ids: &[u32], max_age_s: Option<f64>) -> Result<SerialSource> {
        self.open_as(self.wiring()?, lines, ids, max_age_s)
    }

    /// The same with `wiring` in the place of the file's.
    ///
    /// # Errors
    /// As [`LineKeys::open`].
    #[cfg(feature = "serial")]
    pub fn open_as(
        &self,
        wiring: Option<Wiring>,
        lines: &[(String, Option<u32>)],
        ids: &[u32],
        max_age_s: Option<f64>,
    ) -> Result<SerialSource> {
        let options =
            SerialOptions { wiring, live_rate_hz: self.live_rate_hz, board_rate_hz: self.board_rate_hz, max_age_s };
        SerialSource::open(lines, ids, &options).map_err(|e| match &self.wiring {
            Some(path) if !e.is_usage() => e.at(path.display()),
            _ => e,
        })
    }

    /// Refuses a calibration whose circuit has another wiper position than the wiring sets. `ids` are the body's.
    ///
    /// # Errors
    /// It has another one.
    pub fn check_wipers(&self, calibration: Option<&Calibration>, ids: &[u32]) -> Result<()> {
        let (Some(wiring), Some(calibration), Some(path)) = (self.wiring()?, calibration, &self.wiring) else {
            return Ok(());
        };
        for board in wiring.boards() {
            for (taxel, wiper) in board.taxels.iter().zip(&board.wipers) {
                let (Some(taxel), Some(wiper)) = (*taxel, *wiper) else { continue };
                let Ok(index) = ids.binary_search(&taxel) else { continue };
                if let Response::Fsr(fsr) = calibration.taxels[index].response
                    && fsr.wiper != wiper
                {
                    let what = format!(
                        "it sets wiper {wiper} on taxel {taxel}, and the calibration has wiper {}; make them one, as \
                         `somatic tune --fsr-calibration` does",
                        fsr.wiper
                    );
                    return Err(Error::failed(what).at(path.display()));
                }
            }
        }
        Ok(())
    }
}
