//! What is in a recording.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::{Value, json};

use super::between_s;
use crate::error::Result;
use crate::recording::{Attached, Reader, Rhythm, Survey};
use crate::signal::{Channel, Frame};
use crate::source::{Layout, Source};

/// What a recording holds.
pub struct Contents {
    /// What kind of file it is.
    pub kind: &'static str,
    /// The size of the file.
    pub bytes: u64,
    /// How many taxels a frame has.
    pub taxels: usize,
    /// Times and topics.
    pub survey: Survey,
    /// What an MCAP has beside its frames.
    pub attached: Vec<Attached>,
    /// Whether it is whole: a recording that was cut off is not.
    pub has_end: bool,
    /// What of it could not be read.
    pub losses: Vec<String>,
    /// What was understood of a table.
    pub notes: Vec<String>,
    /// Of a pressure system's export.
    pub layout: Option<Layout>,
}

fn size(path: &Path) -> u64 {
    std::fs::metadata(path).map_or(0, |metadata| metadata.len())
}

/// How many taxels `channels` are of: those with three axes have three.
fn taxels_of(channels: &[u32]) -> usize {
    channels.iter().map(|&channel| Channel(channel).taxel()).collect::<BTreeSet<u32>>().len()
}

impl Contents {
    /// Of the MCAP at `path`, which `reader` reads; `progress` is told the share that was read.
    ///
    /// # Errors
    /// The file cannot be read, or is compressed.
    pub fn of_mcap(path: &Path, reader: &mut Reader, progress: impl FnMut(f64)) -> Result<Self> {
        let survey = Survey::read(reader, progress)?;
        Ok(Self {
            kind: "MCAP",
            bytes: size(path),
            taxels: taxels_of(reader.taxels()),
            attached: reader.attached().to_vec(),
            has_end: reader.has_end(),
            losses: reader.losses(),
            notes: reader.notices(),
            layout: None,
            survey,
        })
    }

    /// Of a recording of nothing but frames, the file at `path`, which is read to its end. `see` gets each frame, and the share that was
    /// read; None if it does not wish to go on.
    ///
    /// # Errors
    /// The source's, and those of `see`.
    pub fn of_frames(
        kind: &'static str,
        path: &Path,
        source: &mut dyn Source,
        mut see: impl FnMut(&Frame, f64) -> Result<bool>,
    ) -> Result<Option<Self>> {
        let mut rhythm = Rhythm::default();
        let mut frame = Frame::missing(0.0, source.taxels().len());
        while source.next_frame(&mut frame)? {
            rhythm.see(frame.t_s);
            if !see(&frame, source.progress().unwrap_or(0.0))? {
                return Ok(None);
            }
        }
        rhythm.finish();
        let losses = source.losses();
        Ok(Some(Self {
            kind,
            bytes: size(path),
            taxels: taxels_of(source.taxels()),
            survey: Survey { rhythm, ..Survey::default() },
            attached: Vec::new(),
            has_end: losses.is_empty(),
            losses,
            notes: source.notices(),
            layout: None,
        }))
    }

    /// From the first frame to the latest, s.
    pub fn duration_s(&self) -> Option<f64> {
        self.survey.rhythm.span_s.map(|[first, last]| between_s(first, last))
    }

    /// All of it: times in seconds, sizes in bytes, areas in m².
    pub fn as_json(&self) -> Value {
        let Self { kind, bytes, taxels, survey, attached, has_end, losses, notes, layout } = self;
        let rhythm = &survey.rhythm;
        let topics: Vec<Value> = survey
            .topics
            .iter()
            .map(|t| json!({"topic": t.name, "encoding": t.encoding, "messages": t.messages, "bytes": t.bytes}))
            .collect();
        let attached: Vec<Value> =
            attached.iter().map(|a| json!({"name": a.name, "media_type": a.media_type, "bytes": a.bytes})).collect();
        json!({
            "kind": kind, "bytes": bytes, "taxels": taxels, "frames": rhythm.frames,
            "start": rhythm.span_s.map(|span| span[0]), "duration": self.duration_s(), "rate_hz": rhythm.rate_hz(),
            "gaps": rhythm.gaps, "longest_gap": rhythm.longest_gap_s.map(|gap| json!({
                "seconds": between_s(gap[1], gap[1] + gap[0]), "after": gap[1],
            })),
            "backwards": rhythm.backwards, "posed_frames": survey.posed, "topics": topics, "attached": attached,
            "ended": has_end, "losses": losses, "notes": notes,
            "unit": layout.as_ref().map(|layout| layout.unit.symbol()),
            "panels": layout.as_ref().map(|layout| layout.panels.iter().map(|panel| json!({
                "name": panel.name, "taxels": panel.cells.len(), "placed": panel.is_placed,
                "area": panel.cells.iter().map(|cell| cell.area_m2).sum::<f64>(),
            })).collect::<Vec<_>>()),
        })
    }
}
