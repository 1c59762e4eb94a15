//! Reads a source on its own thread, so that a blocked read holds up neither who watches nor a clean end.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use crate::error::Error;
use crate::signal::Frame;
#[cfg(any(feature = "serial", feature = "zenoh"))]
use crate::source::Lines;
use crate::source::Source;

/// Frames are gathered for this long at most, so that people see how far a slow source is, such as a simulation.
const GATHERING: Duration = Duration::from_millis(100);

/// What a source delivers.
pub enum Arrival {
    /// The next frames, and information on them.
    Frames(Vec<Frame>, FrameInfo),
    /// The end; a line per kind of loss.
    End(Ending),
    /// It cannot go on.
    Failed(Error),
    /// Something came that is not a frame: percepts of a limb.
    Woken,
}

/// What a source says at its end.
#[derive(Debug, Default)]
#[non_exhaustive]
pub struct Ending {
    /// What was never processed.
    pub losses: Vec<String>,
    /// The last messages for the user.
    pub notices: Vec<String>,
    /// Whether a recording was left before its end.
    pub is_early: bool,
}

/// Information on frames.
#[derive(Debug, Default)]
#[non_exhaustive]
pub struct FrameInfo {
    /// The share of the source that has been read, if known.
    pub progress: Option<f64>,
    /// When the last byte of each frame was read, if known.
    pub read_at: Vec<Instant>,
    /// Whether any value so far was stale.
    pub has_stale: bool,
    /// Messages for the user.
    pub notices: Vec<String>,
    /// What has been lost so far, if requested.
    pub losses: Vec<String>,
    /// What is to be said if these are the last frames.
    pub closing: Vec<String>,
}

/// How a source is read.
#[derive(Clone, Copy, Debug)]
pub struct ReadMode {
    /// Maximum number of frames per arrival.
    pub most: usize,
    /// Wait for `most` frames, but not for long; else pass on those that are there.
    pub gather: bool,
    /// Playback at this many times the recorded speed; `None` is as fast as possible.
    pub speed: Option<f64>,
}

type Queue = (SyncSender<Arrival>, Receiver<Arrival>);

/// A source being read.
pub struct Feed {
    arrivals: Receiver<Arrival>,
    spare: Sender<Vec<Frame>>,
    next: Option<Arrival>,
    most: usize,
    /// That nobody waits for frames any more.
    stopped: Arc<AtomicBool>,
}

impl Drop for Feed {
    fn drop(&mut self) {
        self.stopped.store(true, Ordering::Relaxed);
    }
}

impl Feed {
    /// Starts to read `source`.
    #[must_use]
    pub fn start(source: Box<dyn Source + Send>, mode: ReadMode) -> Self {
        Self::read_by(source, mode, sync_channel(if mode.gather { 4 } else { 1024 }), true)
    }

    /// Starts to read `source`, which itself drops and reports late frames, at most `most` frames at once.
    #[must_use]
    pub fn start_live(source: Box<dyn Source + Send>, most: usize) -> Self {
        Self::read_by(source, ReadMode { most, gather: false, speed: None }, sync_channel(1), false)
    }

    /// The same, and percepts of limbs on its `lines` wake who waits.
    #[cfg(any(feature = "serial", feature = "zenoh"))]
    #[must_use]
    pub fn start_woken(source: Box<dyn Source + Send>, most: usize, lines: &Lines) -> Self {
        let (sender, arrivals) = sync_channel(1);
        let waker = sender.clone();
        // Where a frame waits already, there is no need.
        lines.on_percepts(move || drop(waker.try_send(Arrival::Woken)));
        Self::read_by(source, ReadMode { most, gather: false, speed: None }, (sender, arrivals), false)
    }

    /// Starts to read `source` into a queue of arrivals, with the losses so far if requested.
    fn read_by(mut source: Box<dyn Source + Send>, mode: ReadMode, queue: Queue, with_losses: bool) -> Self {
        let (sender, arrivals) = queue;
        let (spare, used) = channel();
        let stopped = Arc::default();
        source.stop_by(&stopped);
        thread::spawn(move || {
            let end = read(&mut *source, mode, with_losses, &sender, &used);
            // The command may have ended already.
            let _ = sender.send(end);
        });
        Self { arrivals, spare, next: None, most: mode.most, stopped }
    }

    /// The next arrival, if it comes within `wait`.
    pub fn next(&mut self, wait: Duration) -> Option<Arrival> {
        let first = match self.next.take() {
            Some(arrival) => arrival,
            None => match self.arrivals.recv_timeout(wait) {
                Ok(arrival) => arrival,
                Err(RecvTimeoutError::Timeout) => return None,
                Err(RecvTimeoutError::Disconnected) => {
                    Arrival::Failed(Error::failed("the source ended without a reason; read it again"))
                }
            },
        };
        let Arrival::Frames(mut frames, mut info) = first else { return Some(first) };
        while frames.len() < self.most {
            match self.arrivals.try_recv() {
                Ok(Arrival::Frames(more, further)) => {
                    frames.extend(more);
                    info.progress = further.progress;
                    info.read_at.extend(further.read_at);
                    info.has_stale |= further.has_stale;
                    info.notices.extend(further.notices);
                    info.losses = further.losses;
                    info.closing = further.closing;
                }
                Ok(other) => {
                    self.next = Some(other);
                    break;
                }
                Err(_) => break,
            }
        }
        Some(Arrival::Frames(frames, info))
    }

    /// Gives `frames` back, so that their memory is used again.
    pub fn give_back(&self, frames: Vec<Frame>) {
        let _ = self.spare.send(frames);
    }
}

/// Reads all of `source`; returns how it ended.
fn read(
    source: &mut dyn Source,
    mode: ReadMode,
    with_losses: bool,
    to: &SyncSender<Arrival>,
    used: &Receiver<Vec<Frame>>,
) -> Arrival {
    let together = if mode.gather { mode.most } else { 1 };
    let width = source.taxels().len();
    let mut pool: Vec<Frame> = Vec::new();
    let mut clock = mode.speed.map(Clock::new);
    let mut is_empty = true;
    loop {
        pool.extend(used.try_iter().flatten());
        let mut frames = Vec::with_capacity(together);
        let mut info = FrameInfo::default();
        let mut end = None;
        let begin = Instant::now();
        while frames.len() < together && end.is_none() && begin.elapsed() < GATHERING {
            let mut frame = pool.pop().unwrap_or_else(|| Frame::missing(0.0, width));
            match source.next_frame(&mut frame) {
                Ok(true) => {
                    frames.push(frame);
                    info.read_at.extend(source.read_at());
                }
                Ok(false) => end = Some(Arrival::End(Ending { losses: source.losses(), ..Ending::default() })),
                Err(e) => end = Some(Arrival::Failed(e)),
            }
        }
        if let (Some(clock), Some(frame)) = (&mut clock, frames.first()) {
            thread::sleep(clock.until(frame.t_s));
        }
        (info.progress, info.has_stale) = (source.progress(), source.has_stale());
        info.notices = source.notices();
        if with_losses {
            info.losses = source.losses();
        }
        info.closing = source.closing();
        is_empty &= frames.is_empty();
        if let Some(Arrival::End(ending)) = &mut end {
            if is_empty {
                ending.notices.push("the source has ended without a frame".to_owned());
            }
            ending.notices.append(&mut info.notices);
            ending.notices.append(&mut info.closing);
        }
        if !frames.is_empty() && to.send(Arrival::Frames(frames, info)).is_err() {
            return Arrival::End(Ending::default());
        }
        if let Some(end) = end {
            return end;
        }
    }
}

/// Maps recorded time to real time.
struct Clock {
    speed: f64,
    start: Option<(Instant, f64)>,
    last_s: f64,
}

impl Clock {
    fn new(speed: f64) -> Self {
        Self { speed, start: None, last_s: 0.0 }
    }

    /// The time until `t_s` is due. Restarts where recorded time goes back.
    fn until(&mut self, t_s: f64) -> Duration {
        if t_s < self.last_s {
            self.start = None;
        }
        self.last_s = t_s;
        let (begin, first_s) = *self.start.get_or_insert((Instant::now(), t_s));
        let due = Duration::try_from_secs_f64((t_s - first_s) / self.speed).unwrap_or_default();
        due.saturating_sub(begin.elapsed())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::CsvSource;

    const ROWS: &str = "t,4\n0,1\n1,2\n2,3\n3,4\n4,oops\n";

    fn feed(mode: ReadMode) -> Feed {
        Feed::start(Box::new(CsvSource::from_reader("a", ROWS.as_bytes(), None, None).unwrap()), mode)
    }

    #[test]
    fn frames_come_as_asked_for_and_then_what_went_wrong() {
        for (most, gather) in [(1, false), (3, false), (3, true), (99, true)] {
            let mut feed = feed(ReadMode { most, gather, speed: None });
            let mut times = Vec::new();
            let error = loop {
                match feed.next(Duration::from_secs(20)) {
                    Some(Arrival::Frames(frames, _)) => {
                        assert!(frames.len() <= most);
                        times.extend(frames.iter().map(|frame| frame.t_s));
                        feed.give_back(frames);
                    }
                    Some(Arrival::Failed(e)) => break e,
                    _ => panic!("neither frames nor the error"),
                }
            };
            assert_eq!(times, [0.0, 1.0, 2.0, 3.0]);
            assert!(error.to_string().contains("oops"), "{error}");
        }
    }

    /// A source of two frames: one that takes long, and one that waits until the first has been seen.
    struct Slow(u32, Receiver<()>);

    impl Source for Slow {
        fn taxels(&self) -> &[u32] {
            &[4]
        }

        fn next_frame(&mut self, frame: &mut Frame) -> crate::error::Result<bool> {
            match self.0 {
                0 => thread::sleep(GATHERING),
                1 => self.1.recv().unwrap(),
                _ => return Ok(false),
            }
            *frame = Frame::missing(f64::from(self.0), 1);
            self.0 += 1;
            Ok(true)
        }
    }

    #[test]
    fn what_a_slow_source_has_read_is_passed_on_before_all_is_there() {
        let (seen, is_seen) = channel();
        let mut feed = Feed::start(Box::new(Slow(0, is_seen)), ReadMode { most: 99, gather: true, speed: None });
        let mut times = || match feed.next(Duration::from_secs(20)) {
            Some(Arrival::Frames(frames, _)) => frames.iter().map(|frame| frame.t_s).collect::<Vec<_>>(),
            _ => panic!("no frames"),
        };
        assert_eq!(times(), [0.0]);
        seen.send(()).unwrap();
        assert_eq!(times(), [1.0]);
    }

    /// A source of which nothing comes until it is stopped.
    struct Silent(Arc<AtomicBool>, Sender<()>);

    impl Source for Silent {
        fn taxels(&self) -> &[u32] {
            &[4]
        }

        fn stop_by(&mut self, stopped: &Arc<AtomicBool>) {
            self.0 = Arc::clone(stopped);
        }

        fn next_frame(&mut self, _: &mut Frame) -> crate::error::Result<bool> {
            while !self.0.load(Ordering::Relaxed) {
                thread::sleep(Duration::from_millis(1));
            }
            self.1.send(()).unwrap();
            Ok(false)
        }
    }

    #[test]
    fn a_source_that_nobody_reads_any_more_does_not_wait_for_ever() {
        let (sender, ended) = channel();
        let mut feed = Feed::start_live(Box::new(Silent(Arc::default(), sender)), 1);
        assert!(feed.next(Duration::from_millis(20)).is_none() && ended.try_recv().is_err());
        drop(feed);
        assert!(ended.recv_timeout(Duration::from_secs(20)).is_ok());
    }

    #[test]
    fn a_recorded_time_is_due_as_fast_as_asked_for() {
        let mut clock = Clock::new(10.0);
        assert_eq!(clock.until(5.0), Duration::ZERO);
        let wait = clock.until(105.0).as_secs_f64();
        assert!((9.0..=10.0).contains(&wait), "{wait}");
        assert_eq!(clock.until(3.0), Duration::ZERO, "time went back");
        let wait = clock.until(13.0).as_secs_f64();
        assert!((0.5..=1.0).contains(&wait), "{wait}");
    }
}
