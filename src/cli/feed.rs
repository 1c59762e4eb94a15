//! A source on a thread of its own, so that a read that blocks holds up neither the table nor a clean end.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use somatic::source::Source;
use somatic::{Error, Frame};

/// What comes from a source.
pub(super) enum Arrival {
    /// The next frames, and what is known of them.
    Frames(Vec<Frame>, Told),
    /// There is no more; what was lost on the way.
    End(Vec<String>),
    /// It cannot go on.
    Failed(Error),
}

/// What a source tells of frames beside them.
#[derive(Debug, Default)]
pub(super) struct Told {
    /// How much of the whole has been read, where that is known.
    pub(super) progress: Option<f64>,
    /// When the last byte of each was read, of those of which that is known.
    pub(super) read_at: Vec<Instant>,
    /// Whether anything so far is stale.
    pub(super) has_stale: bool,
    /// What is to be said of them.
    pub(super) notices: Vec<String>,
    /// What has been lost so far, where that is asked for.
    pub(super) losses: Vec<String>,
}

/// How frames are to come.
#[derive(Clone, Copy)]
pub(super) struct Manner {
    /// Frames at once, at most.
    pub(super) most: usize,
    /// Wait until there are so many; else take those that are there.
    pub(super) gather: bool,
    /// As fast as they were recorded, times this.
    pub(super) speed: Option<f64>,
}

/// A source being read.
pub(super) struct Feed {
    arrivals: Receiver<Arrival>,
    spare: Sender<Vec<Frame>>,
    next: Option<Arrival>,
    most: usize,
}

impl Feed {
    /// Starts to read `source`.
    pub(super) fn start(source: Box<dyn Source + Send>, manner: Manner) -> Self {
        Self::holding(source, manner, if manner.gather { 4 } else { 1024 }, true)
    }

    /// Starts to read `source`, which itself drops and tells what is not taken in time, at most so many frames at once.
    pub(super) fn start_live(source: Box<dyn Source + Send>, most: usize) -> Self {
        Self::holding(source, Manner { most, gather: false, speed: None }, 1, false)
    }

    /// Starts to read `source`, of which so many arrivals may wait, with what it lost up to each if that is asked for.
    fn holding(mut source: Box<dyn Source + Send>, manner: Manner, waiting: usize, with_losses: bool) -> Self {
        let (sender, arrivals) = sync_channel(waiting);
        let (spare, used) = channel();
        thread::spawn(move || {
            let end = read(&mut *source, manner, with_losses, &sender, &used);
            // Nobody hears it when the command has ended already.
            let _ = sender.send(end);
        });
        Self { arrivals, spare, next: None, most: manner.most }
    }

    /// What comes next, if it does so within `wait`.
    pub(super) fn next(&mut self, wait: Duration) -> Option<Arrival> {
        let first = match self.next.take() {
            Some(arrival) => arrival,
            None => match self.arrivals.recv_timeout(wait) {
                Ok(arrival) => arrival,
                Err(RecvTimeoutError::Timeout) => return None,
                Err(RecvTimeoutError::Disconnected) => Arrival::Failed(Error::failed("the source broke down")),
            },
        };
        let Arrival::Frames(mut frames, mut told) = first else { return Some(first) };
        while frames.len() < self.most {
            match self.arrivals.try_recv() {
                Ok(Arrival::Frames(more, further)) => {
                    frames.extend(more);
                    told.progress = further.progress;
                    told.read_at.extend(further.read_at);
                    told.has_stale |= further.has_stale;
                    told.notices.extend(further.notices);
                    told.losses = further.losses;
                }
                Ok(other) => {
                    self.next = Some(other);
                    break;
                }
                Err(_) => break,
            }
        }
        Some(Arrival::Frames(frames, told))
    }

    /// Takes back frames whose memory can be used again.
    pub(super) fn give_back(&self, frames: Vec<Frame>) {
        let _ = self.spare.send(frames);
    }
}

/// Reads all of `source`; what it returns is how that ended.
fn read(
    source: &mut dyn Source,
    manner: Manner,
    with_losses: bool,
    to: &SyncSender<Arrival>,
    used: &Receiver<Vec<Frame>>,
) -> Arrival {
    let together = if manner.gather { manner.most } else { 1 };
    let width = source.taxels().len();
    let mut pool: Vec<Frame> = Vec::new();
    let mut clock = manner.speed.map(Clock::new);
    loop {
        pool.extend(used.try_iter().flatten());
        let mut frames = Vec::with_capacity(together);
        let mut told = Told::default();
        let mut end = None;
        while frames.len() < together && end.is_none() {
            let mut frame = pool.pop().unwrap_or_else(|| Frame::missing(0.0, width));
            match source.next_frame(&mut frame) {
                Ok(true) => {
                    frames.push(frame);
                    told.read_at.extend(source.read_at());
                }
                Ok(false) => end = Some(Arrival::End(source.losses())),
                Err(e) => end = Some(Arrival::Failed(e)),
            }
        }
        if let (Some(clock), Some(frame)) = (&mut clock, frames.first()) {
            thread::sleep(clock.until(frame.t_s));
        }
        (told.progress, told.has_stale) = (source.progress(), source.has_stale());
        told.notices = source.notices();
        if with_losses {
            told.losses = source.losses();
        }
        if !frames.is_empty() && to.send(Arrival::Frames(frames, told)).is_err() {
            return Arrival::End(Vec::new());
        }
        if let Some(end) = end {
            return end;
        }
    }
}

/// When a recorded time is due.
struct Clock {
    speed: f64,
    start: Option<(Instant, f64)>,
    last_s: f64,
}

impl Clock {
    fn new(speed: f64) -> Self {
        Self { speed, start: None, last_s: 0.0 }
    }

    /// How long it is until `t_s` is due. Where recorded time goes back, it starts anew.
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
    use somatic::source::CsvSource;

    const ROWS: &str = "t,4\n0,1\n1,2\n2,3\n3,4\n4,oops\n";

    fn feed(manner: Manner) -> Feed {
        Feed::start(Box::new(CsvSource::from_reader("a", ROWS.as_bytes(), None, None).unwrap()), manner)
    }

    #[test]
    fn frames_come_as_asked_for_and_then_what_went_wrong() {
        for (most, gather) in [(1, false), (3, false), (3, true), (99, true)] {
            let mut feed = feed(Manner { most, gather, speed: None });
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
