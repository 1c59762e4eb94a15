//! Frames that are copied into a file.

use crate::error::Result;
use crate::output::OutputPath;
use crate::recording::Recorder;
use crate::signal::Frame;
use crate::source::{CsvFile, Source};

/// A file that frames are copied to.
pub enum FrameFile {
    /// A table.
    Csv(CsvFile),
    /// A recording.
    Mcap(Box<Recorder>),
}

/// What was copied.
#[derive(Default)]
pub struct Copied {
    /// How many frames.
    pub frames: u64,
    /// Frames with poses.
    pub posed: u64,
    /// The time of the last frame, s.
    pub last_s: f64,
    /// Whether it was not interrupted.
    pub is_whole: bool,
}

impl FrameFile {
    /// A table of frames of these taxels.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn csv(output: OutputPath, taxels: &[u32]) -> Result<Self> {
        CsvFile::create(output, taxels).map(Self::Csv)
    }

    /// A recording of frames of these taxels, and of what is to lie beside them: name, media type, bytes.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn mcap(output: OutputPath, taxels: &[u32], attached: &[(String, String, Vec<u8>)]) -> Result<Self> {
        let mut recorder = Recorder::create_whole(output, taxels)?;
        for (name, media_type, bytes) in attached {
            recorder.attach(name, media_type, bytes)?;
        }
        Ok(Self::Mcap(Box::new(recorder)))
    }

    /// Copies all frames of `source`; `goes_on` is asked before each frame, with how many there were and the share that was read.
    ///
    /// # Errors
    /// The source's, and the file cannot be written.
    pub fn copy(&mut self, source: &mut dyn Source, mut goes_on: impl FnMut(u64, f64) -> bool) -> Result<Copied> {
        let mut frame = Frame::missing(0.0, source.taxels().len());
        let mut copied = Copied::default();
        while source.next_frame(&mut frame)? {
            if !goes_on(copied.frames, source.progress().unwrap_or(0.0)) {
                return Ok(copied);
            }
            match self {
                Self::Csv(file) => file.frame(&frame)?,
                Self::Mcap(recorder) => recorder.frame(&frame)?,
            }
            copied.frames += 1;
            copied.posed += u64::from(!frame.pose.is_empty());
            copied.last_s = frame.t_s;
        }
        Ok(Copied { is_whole: true, ..copied })
    }

    /// What of the frames of `source` it has no place for, and of what is `attached` beside them, by name.
    pub fn left_behind(&self, source: &dyn Source, copied: &Copied, attached: &[&str]) -> Vec<String> {
        let mut said = Vec::new();
        if matches!(self, Self::Mcap(_)) {
            return said;
        }
        if copied.posed > 0 {
            let frames = if copied.posed == 1 { "frame" } else { "frames" };
            said.push(format!("a CSV has no place for poses: the poses of {} {frames} are left out", copied.posed));
        }
        if source.has_stale() {
            said.push("a CSV cannot mark stale values: they are missing there".to_owned());
        }
        if !attached.is_empty() {
            said.push(format!("a CSV has no place for what is attached: {} left out", attached.join(", ")));
        }
        said
    }

    /// Ends it.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn finish(self) -> Result<()> {
        match self {
            Self::Csv(file) => file.finish(),
            Self::Mcap(recorder) => recorder.finish(),
        }
    }

    /// Ends it where copying was interrupted; gives the name of a file that is left out, as it would be half of one.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn finish_early(self) -> Result<Option<String>> {
        match self {
            Self::Csv(file) => file.finish_early(),
            Self::Mcap(recorder) => recorder.finish_early(),
        }
    }
}
