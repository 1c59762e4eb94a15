//! A run: the loop from a feed through an engine to sinks.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use somatic_engine::Agreement;

use super::feed::{Arrival, Ending, Feed, FrameInfo};
use super::observer::{Observer, Remark};
use super::serve::Sinks;
use super::unfit::UnfitReport;
use crate::engine::Engine;
use crate::error::Result;
use crate::plain;
use crate::signal::Frame;
use crate::sink::{InputFrames, News, Question, Sink};
#[cfg(any(feature = "serial", feature = "zenoh"))]
use crate::source::Lines;

/// How long a run waits for frames before it looks at other things.
const WAIT: Duration = Duration::from_millis(40);

/// How a run goes.
#[derive(Clone, Debug, Default)]
pub struct RunOptions {
    /// Whether somebody waits for every frame: sinks pass on all they have at once, and one that fails is left out.
    pub is_live: bool,
    /// Whether every percept is compared with the reference's.
    pub verify: bool,
    /// Whether the engine tracks stale values from the first frame on; else from the first stale one on.
    pub tracks_stale: bool,
    /// The name of the source, if it is a recording, which ends.
    pub recording: Option<String>,
    /// When the run ends, if it does not end before.
    pub until: Option<Instant>,
}

/// A recording that is run after another one, into the same sinks.
pub struct Following {
    /// What people call it.
    pub name: String,
    /// Makes its engine, whose fields are those of the first recording's, and starts to read it.
    pub begin: Box<dyn FnOnce() -> Result<Begun> + Send>,
}

somatic_skin::debug_by_name!(Following);

/// A recording that is read.
pub struct Begun {
    /// Knows its taxels.
    pub engine: Engine,
    /// Its frames.
    pub feed: Feed,
    /// The ids of a frame's values, in their order.
    pub taxels: Vec<u32>,
}

somatic_skin::debug_by_name!(Begun);

/// A run: takes frames from a feed through an engine to whoever is to have the percepts.
pub struct Run {
    engine: Engine,
    feed: Feed,
    sinks: Sinks,
    options: RunOptions,
    agreement: Option<Agreement>,
    unfit: UnfitReport,
    heeds_stale: bool,
    /// The share of the source that has been read, if known.
    progress: Option<f64>,
    /// Frames that were processed.
    frames: u64,
    /// Recordings that follow.
    following: VecDeque<Following>,
    /// Those that have ended.
    ended: Ended,
    /// Boards or limbs whose messages nobody else reads.
    #[cfg(any(feature = "serial", feature = "zenoh"))]
    pub(super) lines: Option<Lines>,
}

somatic_skin::debug_by_name!(Run);

/// Recordings of a run that have ended.
#[derive(Default)]
struct Ended {
    recordings: usize,
    frames: u64,
    losses: Vec<String>,
    notices: Vec<String>,
}

/// What became of a run.
#[derive(Debug)]
#[non_exhaustive]
pub struct Outcome {
    /// The engine, after its last frame; of several recordings the last one's.
    pub engine: Engine,
    /// How many frames were processed.
    pub frames: u64,
    /// The last messages about taxels.
    pub remarks: Vec<String>,
    /// What was never processed, a line each.
    pub losses: Vec<String>,
    /// The last messages of the source.
    pub notices: Vec<String>,
    /// How percepts agree with the reference's, if that was compared.
    pub agreement: Option<Agreement>,
    /// Whether a sink could not go on.
    pub has_failed: bool,
}

impl Run {
    /// A run that has all it needs: what comes from `feed` goes through `engine`, which knows the source's taxels, to `sinks`.
    #[doc(hidden)]
    #[must_use]
    pub fn new(engine: Engine, feed: Feed, sinks: Vec<Box<dyn Sink + Send>>, options: RunOptions) -> Self {
        Self {
            engine,
            feed,
            sinks: Sinks { open: sinks, is_live: options.is_live, has_failed: false },
            agreement: options.verify.then(Agreement::default),
            unfit: UnfitReport::default(),
            heeds_stale: options.tracks_stale,
            progress: None,
            frames: 0,
            following: VecDeque::new(),
            ended: Ended::default(),
            #[cfg(any(feature = "serial", feature = "zenoh"))]
            lines: None,
            options,
        }
    }

    /// The same, and then other recordings, each from a state of its own.
    #[doc(hidden)]
    #[must_use]
    pub fn followed_by(self, following: Vec<Following>) -> Self {
        Self { following: following.into(), ..self }
    }

    /// Runs until the source ends, the last reader has gone, or `is_ended`; gives what the source says at its end.
    ///
    /// # Errors
    /// The source, the engine, or the last sink cannot go on.
    pub fn run(&mut self, observer: &mut dyn Observer, is_ended: impl Fn() -> bool) -> Result<Ending> {
        let is_watched = observer.is_watching() || self.sinks.open.is_empty();
        let mut ending = Ending::default();
        while !is_ended() && self.options.until.is_none_or(|until| Instant::now() < until) {
            match self.feed.next(WAIT) {
                Some(Arrival::Frames(frames, mut info)) => {
                    (ending.losses, ending.notices) =
                        (std::mem::take(&mut info.losses), std::mem::take(&mut info.closing));
                    self.progress = info.progress;
                    info.progress = self.progress_of_all();
                    self.pass_on(&frames, &info, observer)?;
                    if self.sinks.open.is_empty() && !is_watched {
                        break;
                    }
                    observer.written(&info.read_at);
                    self.feed.give_back(frames);
                    self.report_unfit(observer)?;
                }
                Some(Arrival::End(end)) => match self.following.pop_front() {
                    Some(next) => {
                        self.begin(next, end, observer)?;
                        ending = Ending::default();
                        if self.sinks.open.is_empty() && !is_watched {
                            break;
                        }
                    }
                    None => return Ok(end),
                },
                Some(Arrival::Failed(error)) => return Err(error),
                // Nothing comes, but something may be held back.
                None if self.options.is_live => self.sinks.each(observer, |sink| sink.flush())?,
                None | Some(Arrival::Woken) => {}
            }
            #[cfg(any(feature = "serial", feature = "zenoh"))]
            for notice in self.lines.iter().flat_map(Lines::notices) {
                observer.remark(Remark::Note, &notice.text);
            }
            if let Some((lines, read_at)) = observer.percepts_of_limbs() {
                self.sinks.give_lines(observer, &lines)?;
                observer.written(&read_at);
            }
            if let Some(news) = observer.news() {
                self.sinks.each(observer, |sink| sink.write_news(&news))?;
            }
            observer.turned();
        }
        // Who has only looked at it has no part of anything.
        ending.is_early = self.options.recording.is_some() && !self.sinks.open.is_empty() && is_ended();
        Ok(ending)
    }

    /// The share of all recordings that has been read, if known; each counts alike.
    fn progress_of_all(&self) -> Option<f64> {
        let all = self.ended.recordings + 1 + self.following.len();
        self.progress.map(|progress| (self.ended.recordings as f64 + progress) / all as f64)
    }

    /// Begins the recording `next` after one whose end is `end`.
    fn begin(&mut self, next: Following, end: Ending, observer: &mut dyn Observer) -> Result<()> {
        let name = self.options.recording.replace(next.name).unwrap_or_default();
        let of_it = |text: String| of_recording(&name, &text);
        self.ended.losses.extend(end.losses.into_iter().map(of_it));
        self.ended.notices.extend(end.notices.into_iter().map(of_it));
        let unfit = std::mem::take(&mut self.unfit);
        self.ended.notices.extend(unfit.repeats().map(of_it));
        self.ended.frames = self.frames;
        self.ended.recordings += 1;
        let Begun { engine, feed, taxels } = (next.begin)()?;
        (self.engine, self.feed) = (engine, feed);
        (self.heeds_stale, self.progress) = (self.options.tracks_stale, None);
        let index = self.ended.recordings;
        self.sinks.each(observer, |sink| sink.begin_recording(index))?;
        observer.began(self.options.recording.as_deref().unwrap_or_default(), &self.engine, &taxels);
        Ok(())
    }

    /// Takes `frames` through the engine, and gives every sink what that made of them.
    fn pass_on(&mut self, frames: &[Frame], info: &FrameInfo, observer: &mut dyn Observer) -> Result<()> {
        info.notices.iter().for_each(|notice| observer.remark(Remark::Note, notice));
        if info.has_stale && !std::mem::replace(&mut self.heeds_stale, true) {
            self.engine.track_stale();
        }
        let begin = Instant::now();
        let questions: Vec<Question> = self.sinks.open.iter_mut().flat_map(|sink| sink.questions()).collect();
        if !questions.is_empty() {
            observer.asked(questions, self.engine.state()?, frames);
        }
        if let Some(sum) = &mut self.agreement {
            sum.merge(self.engine.process_and_compare(frames)?.1);
        } else {
            self.engine.process(frames)?;
        }
        if let Some(notice) = self.engine.notice() {
            observer.remark(Remark::Warning, &notice);
        }
        let call = begin.elapsed();
        observer.computed(&self.engine, frames, info);
        self.frames += frames.len() as u64;
        self.unfit.at_s = frames.last().map_or(self.unfit.at_s, |frame| frame.t_s);
        let engine = &self.engine;
        let input = InputFrames {
            frames,
            pressures: &|frame, to| engine.pressures(frame, to),
            sensed: &|frame, taxels, to| engine.sensed_alone(frame, taxels, to),
            plan: engine.plan(),
            values_read: engine.values_read(),
            values_noted: engine.values_noted(),
            values_sensed: engine.values_sensed(),
            arrived: info.read_at.last().copied(),
            call,
        };
        self.sinks.give(observer, &input, engine.percepts())
    }

    /// Reports taxels that are left out, or used again, to sinks and who watches.
    fn report_unfit(&mut self, observer: &mut dyn Observer) -> Result<()> {
        let messages = self.unfit.changes(&self.engine);
        if messages.is_empty() {
            return Ok(());
        }
        messages.iter().for_each(|message| observer.remark(Remark::Note, message));
        let at_s = self.unfit.at_s;
        let taxels = messages.into_iter().map(|message| (at_s, message)).collect();
        let news = News { taxels, ..News::default() };
        self.sinks.each(observer, |sink| sink.write_news(&news))
    }

    /// Makes all outputs whole, or those of a recording that was left before its end absent, and gives what is to be said.
    ///
    /// # Errors
    /// An output cannot be completed.
    pub fn finish(mut self, ending: Ending) -> Result<Outcome> {
        let Ending { mut losses, mut notices, is_early } = ending;
        #[cfg(any(feature = "serial", feature = "zenoh"))]
        if let Some(lines) = &self.lines {
            lines.close();
            losses = lines.losses();
        }
        let mut absent = Vec::new();
        for sink in self.sinks.open {
            match is_early {
                true => absent.extend(sink.finish_early()?),
                false => sink.finish()?,
            }
        }
        if is_early {
            let recording = self.options.recording.as_deref().unwrap_or_default();
            losses.push(left_out(recording, self.frames - self.ended.frames, self.unfit.at_s, self.progress, &absent));
        }
        losses.splice(..0, self.ended.losses);
        if self.ended.recordings > 0 {
            let name = self.options.recording.as_deref().unwrap_or_default();
            notices.iter_mut().for_each(|notice| *notice = of_recording(name, notice));
        }
        notices.splice(..0, self.ended.notices);
        let mut remarks = self.unfit.changes(&self.engine);
        remarks.extend(self.unfit.repeats());
        Ok(Outcome {
            engine: self.engine,
            frames: self.frames,
            remarks,
            losses,
            notices,
            agreement: self.agreement,
            has_failed: self.sinks.has_failed,
        })
    }
}

/// The message `text` about `recording`, with its name.
fn of_recording(recording: &str, text: &str) -> String {
    if text.contains(recording) { text.to_owned() } else { format!("{recording}: {text}") }
}

/// The message about a recording that was left before its end, after `frames` frames, the last one at `t_s`; and of the files that
/// are `absent` for this reason.
#[must_use]
pub fn left_out(recording: &str, frames: u64, t_s: f64, progress: Option<f64>, absent: &[String]) -> String {
    let t_s = plain::seconds(t_s);
    let mut text = match frames {
        0 => format!("{recording}: interrupted before its first frame"),
        1 => format!("{recording} after t = {t_s} s: interrupted after 1 frame"),
        frames => format!("{recording} after t = {t_s} s: interrupted after {frames} frames"),
    };
    if let Some(progress) = progress.filter(|_| frames > 0) {
        text += &format!(", {:.0} % of it", 100.0 * progress);
    }
    let are = if absent.len() == 1 { "is" } else { "are" };
    if !absent.is_empty() {
        text += &format!("; {} {are} not written", absent.join(", "));
    }
    text
}
