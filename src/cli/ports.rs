//! Serial lines as sources: the flags that commands have for them, and how they are opened.

use std::path::PathBuf;

use clap::Args;
use somatic::signal::{Response, Wiring};
use somatic::source::{SerialOptions, SerialSource, SourceSpec};
use somatic::{Calibration, Error, Result};

/// How boards on serial lines are read.
#[derive(Args, Clone, Debug, Default)]
pub(super) struct LineFlags {
    /// Which taxel is on which channel of which board, a TOML file as `somatic board --help` shows [default: the boards, one per port,
    /// share the taxels in ascending order of their ids].
    #[arg(long, value_name = "FILE")]
    pub(super) wiring: Option<PathBuf>,

    /// Merge the boards' frames at this rate, in Hz; 0 gives one for each frame of any board [default: one for each
    /// frame of the fastest board].
    #[arg(long, value_name = "HZ")]
    pub(super) live_rate: Option<f64>,

    /// Tell the boards to send frames at this rate, in Hz; 0 is as fast as the line allows [default: leave them as they
    /// are].
    #[arg(long, value_name = "HZ")]
    pub(super) board_rate: Option<f64>,
}

impl LineFlags {
    /// The lines that `sources` name, each with its speed in baud where one is given; none where they are no serial lines.
    pub(super) fn lines(&self, sources: &[String]) -> Result<Vec<(String, Option<u32>)>> {
        let mut lines = Vec::new();
        let mut limbs = 0;
        for source in sources {
            match source.parse()? {
                SourceSpec::Serial { port, baud } => lines.push((port, baud)),
                SourceSpec::Zenoh(_) => limbs += 1,
                _ => {}
            }
        }
        if sources.len() > 1 && lines.len() < sources.len() && limbs < sources.len() {
            return Err(Error::usage(
                "only serial lines, or only limbs, are read several at a time; merge the others, or run once for each",
            ));
        }
        let of_lines = [
            ("--wiring", self.wiring.is_some()),
            ("--live-rate", self.live_rate.is_some() && limbs == 0),
            ("--board-rate", self.board_rate.is_some()),
        ];
        match of_lines.iter().find(|(_, given)| *given && lines.is_empty()) {
            Some((flag, _)) => {
                Err(Error::usage(format!("{flag} is for boards on serial lines; add --source serial:PORT")))
            }
            None => Ok(lines),
        }
    }

    pub(super) fn wiring(&self) -> Result<Option<Wiring>> {
        self.wiring.as_ref().map(Wiring::load).transpose()
    }

    /// Opens `lines` for a body whose taxels have `ids`, values being up to `max_age_s` old. What is wrong with the wiring is
    /// told with its file.
    pub(super) fn open(
        &self,
        lines: &[(String, Option<u32>)],
        ids: &[u32],
        max_age_s: Option<f64>,
    ) -> Result<SerialSource> {
        self.open_as(self.wiring()?, lines, ids, max_age_s)
    }

    /// The same with `wiring` in the place of the file's.
    pub(super) fn open_as(
        &self,
        wiring: Option<Wiring>,
        lines: &[(String, Option<u32>)],
        ids: &[u32],
        max_age_s: Option<f64>,
    ) -> Result<SerialSource> {
        let options = SerialOptions { wiring, live_rate_hz: self.live_rate, board_rate_hz: self.board_rate, max_age_s };
        SerialSource::open(lines, ids, &options).map_err(|e| match &self.wiring {
            Some(path) if !e.is_usage() => e.at(path.display()),
            _ => e,
        })
    }

    /// Refuses a calibration whose circuit has another wiper position than the wiring sets. `ids` are the body's.
    pub(super) fn check_wipers(&self, calibration: Option<&Calibration>, ids: &[u32]) -> Result<()> {
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
