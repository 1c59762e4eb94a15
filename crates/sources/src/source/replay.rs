//! Replays a part of a recording, once or repeatedly.

use super::Source;
use crate::error::{Error, Result};
use crate::signal::Frame;

/// The part of a recording to replay, and the number of repetitions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// Start, s after its first frame.
    pub from_s: f64,
    /// End, s after its first frame, exclusive.
    pub to_s: f64,
    /// Number of repetitions; 0 is endless.
    pub times: u64,
}

impl Cut {
    /// The whole recording, once.
    pub const WHOLE: Self = Self { from_s: 0.0, to_s: f64::INFINITY, times: 1 };
}

type Open = Box<dyn FnMut() -> Result<Box<dyn Source + Send>> + Send>;

/// Replays a part of a source. Times continue over repetitions: the first frame follows the last one by the same step as
/// between the last two.
pub struct Replay {
    open: Open,
    source: Box<dyn Source + Send>,
    taxels: Vec<u32>,
    cut: Cut,
    played: u64,
    /// Time of the first frame of this repetition, s.
    start_s: Option<f64>,
    /// Offset added to its times, s.
    shift_s: f64,
    /// The last delivered time and the step before it, s.
    last_s: Option<f64>,
    step_s: f64,
    /// Whether this repetition has delivered a frame.
    has_delivered: bool,
    /// Whether the next frame is the first of a repetition.
    restarted: bool,
    /// Whether stale values are to be marked, and whether earlier repetitions had any.
    marks_stale: bool,
    had_stale: bool,
    losses: Vec<String>,
}

somatic_skin::debug_by_name!(Replay);

impl Replay {
    /// Replays `cut` of the source that `open` opens, once per repetition.
    ///
    /// # Errors
    /// The source cannot be opened, or `cut` is empty.
    pub fn new(mut open: impl FnMut() -> Result<Box<dyn Source + Send>> + Send + 'static, cut: Cut) -> Result<Self> {
        let Cut { from_s, to_s, .. } = cut;
        if !from_s.is_finite() || from_s < 0.0 || to_s.is_nan() || to_s <= from_s {
            return Err(Error::usage(format!(
                "from {from_s} s to {to_s} s is not a part of a recording; give seconds from its start, the first below the second"
            )));
        }
        let source = open()?;
        Ok(Self {
            taxels: source.taxels().to_vec(),
            open: Box::new(open),
            source,
            cut,
            played: 0,
            start_s: None,
            shift_s: 0.0,
            last_s: None,
            step_s: 0.0,
            has_delivered: false,
            restarted: false,
            marks_stale: false,
            had_stale: false,
            losses: Vec::new(),
        })
    }

    /// Starts the next repetition, if any is left.
    fn next_repetition(&mut self) -> Result<bool> {
        self.losses = self.losses();
        self.played += 1;
        // Whoever reads in batches asks again at the end.
        let is_over = self.cut.times > 0 && self.played >= self.cut.times;
        if is_over || !self.has_delivered {
            return Ok(false);
        }
        self.had_stale |= self.source.has_stale();
        self.source = (self.open)()?;
        if self.marks_stale {
            self.source.report_stale();
        }
        (self.start_s, self.has_delivered, self.restarted) = (None, false, true);
        Ok(true)
    }
}

impl Source for Replay {
    fn taxels(&self) -> &[u32] {
        &self.taxels
    }

    fn wrapped(&self) -> Option<&dyn Source> {
        Some(&*self.source)
    }

    fn wrapped_mut(&mut self) -> Option<&mut dyn Source> {
        Some(&mut *self.source)
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        loop {
            if !self.source.next_frame(frame)? {
                if self.next_repetition()? {
                    continue;
                }
                return Ok(false);
            }
            let start_s = match self.start_s {
                Some(start_s) => start_s,
                None => {
                    if self.cut.from_s > 0.0 {
                        self.source.skip_to(frame.t_s + self.cut.from_s);
                    }
                    *self.start_s.insert(frame.t_s)
                }
            };
            let since_s = frame.t_s - start_s;
            if since_s < self.cut.from_s {
                continue;
            }
            if since_s >= self.cut.to_s {
                if self.next_repetition()? {
                    continue;
                }
                // The rest is not requested, so it is not a loss.
                self.cut.times = self.played;
                self.has_delivered = false;
                return Ok(false);
            }
            if std::mem::take(&mut self.restarted) {
                self.shift_s = self.last_s.unwrap_or(0.0) + self.step_s - frame.t_s;
            }
            // Adding 0 would turn −0 into 0.
            if self.shift_s != 0.0 {
                frame.t_s += self.shift_s;
            }
            if let Some(last_s) = self.last_s {
                self.step_s = frame.t_s - last_s;
            }
            self.last_s = Some(frame.t_s);
            self.has_delivered = true;
            return Ok(true);
        }
    }

    fn progress(&self) -> Option<f64> {
        if self.cut.times == 0 {
            return None;
        }
        let done = self.played as f64 + self.source.progress().unwrap_or(0.0);
        Some((done / self.cut.times as f64).min(1.0))
    }

    /// It skips by itself: its times are not those of the source.
    fn skip_to(&mut self, _: f64) {}

    fn report_stale(&mut self) {
        self.marks_stale = true;
        self.source.report_stale();
    }

    fn has_stale(&self) -> bool {
        self.had_stale || self.source.has_stale()
    }

    fn losses(&self) -> Vec<String> {
        let mut losses = self.losses.clone();
        losses.extend(self.source.losses().into_iter().filter(|loss| !self.losses.contains(loss)));
        losses
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::CsvSource;

    const ROWS: &str = "t,4\n10,1\n10.5,2\n11,3\n11.5,4\n";

    fn played(text: &'static str, cut: Cut, most: usize) -> (Vec<(f64, f64)>, Vec<String>) {
        let open = move || -> Result<Box<dyn Source + Send>> {
            Ok(Box::new(CsvSource::from_reader("a", text.as_bytes(), None, None)?))
        };
        let mut replay = Replay::new(open, cut).unwrap();
        let mut frame = Frame::missing(0.0, 1);
        let mut frames = Vec::new();
        while frames.len() < most && replay.next_frame(&mut frame).unwrap() {
            frames.push((frame.t_s, frame.values[0].number().unwrap()));
        }
        (frames, replay.losses())
    }

    #[test]
    fn a_part_is_from_one_time_up_to_another() {
        let all = [(10.0, 1.0), (10.5, 2.0), (11.0, 3.0), (11.5, 4.0)];
        assert_eq!(played(ROWS, Cut::WHOLE, 99).0, all);
        assert_eq!(played(ROWS, Cut { from_s: 0.5, to_s: 1.5, times: 1 }, 99).0, all[1..3]);
        assert_eq!(played(ROWS, Cut { from_s: 9.0, to_s: 10.0, times: 0 }, 99).0, []);
    }

    #[test]
    fn time_goes_on_where_it_is_played_again() {
        let twice = played(ROWS, Cut { to_s: 1.0, times: 2, ..Cut::WHOLE }, 99).0;
        assert_eq!(twice, [(10.0, 1.0), (10.5, 2.0), (11.0, 1.0), (11.5, 2.0)]);
        assert_eq!(played(ROWS, Cut { times: 0, ..Cut::WHOLE }, 9).0.len(), 9, "without end");
    }

    #[test]
    fn an_end_is_one_however_often_it_is_asked_for() {
        for (to_s, times, length) in [(f64::INFINITY, 1, 3), (1.5, 1, 2), (f64::INFINITY, 2, 6), (1.5, 2, 4)] {
            let open = || -> Result<Box<dyn Source + Send>> {
                Ok(Box::new(CsvSource::from_reader("a", ROWS.as_bytes(), None, None)?))
            };
            let mut replay = Replay::new(open, Cut { from_s: 0.5, to_s, times }).unwrap();
            let mut frame = Frame::missing(0.0, 1);
            let asked: Vec<bool> = (0..20).map(|_| replay.next_frame(&mut frame).unwrap()).collect();
            assert!(
                asked.iter().position(|there| !there) == Some(length) && !asked[length..].contains(&true),
                "{asked:?}"
            );
            assert_eq!(replay.progress(), Some(1.0));
        }
    }

    #[test]
    fn a_loss_is_reported_once() {
        let (frames, losses) = played("t,4\n0,1\n1,2\n2", Cut { times: 3, ..Cut::WHOLE }, 99);
        assert_eq!((frames.len(), losses.len()), (6, 1), "{losses:?}");
    }

    #[test]
    fn no_part_is_refused() {
        for (from_s, to_s) in [(2.0, 1.0), (-1.0, 3.0), (f64::NAN, 3.0), (1.0, 1.0)] {
            let open = || -> Result<Box<dyn Source + Send>> {
                Ok(Box::new(CsvSource::from_reader("a", ROWS.as_bytes(), None, None)?))
            };
            assert!(Replay::new(open, Cut { from_s, to_s, times: 1 }).err().unwrap().is_usage());
        }
    }
}
