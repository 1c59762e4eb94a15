//! What of a file was whole, and what was not.

use super::summary::{Summary, Trust};
use crate::plain::seconds;

/// Counts what is whole in a file, and tells what is not.
pub(super) struct Account {
    /// What people call the file.
    name: String,
    /// What is read from it, such as `frame`.
    thing: &'static str,
    /// How many were whole, and the time of the last, s.
    whole: u64,
    last_s: Option<f64>,
    /// Places that are damaged, and bytes that were not read there.
    places: u64,
    bytes: u64,
    /// Where the last of them ends.
    damaged_to: Option<u64>,
    /// The times before and after the first of them, s.
    after_s: Option<f64>,
    before_s: Option<f64>,
    cut: Option<Cut>,
    summary: SummaryState,
    /// How many the file says that it has, and how many were read, once everything was.
    counts: Option<[u64; 2]>,
    /// Records of other programs, if nothing says that these hold no messages.
    strange: u64,
}

/// How a file ends before its end.
struct Cut {
    /// Bytes that are not a whole chunk.
    bytes: u64,
    /// Whether its data are over.
    is_in_summary: bool,
}

/// The part of a [`Summary`] that is reported.
struct SummaryState {
    trust: Trust,
    shift: i64,
    gone: usize,
    gone_ns: Option<[u64; 2]>,
    listed: usize,
}

impl Account {
    /// For the file called `name` with `summary`; `thing` is what is read.
    pub(super) fn new(name: &str, thing: &'static str, summary: &Summary) -> Self {
        let Summary { trust, shift, gone, gone_ns, .. } = *summary;
        let listed = summary.chunks.len() + gone;
        Self::of(name, thing, SummaryState { trust, shift, gone, gone_ns, listed })
    }

    fn of(name: &str, thing: &'static str, summary: SummaryState) -> Self {
        Self {
            name: name.to_owned(),
            thing,
            whole: 0,
            last_s: None,
            places: 0,
            bytes: 0,
            damaged_to: None,
            after_s: None,
            before_s: None,
            cut: None,
            summary,
            counts: None,
            strange: 0,
        }
    }

    /// Of the file called `name`, which has no summary, of which `thing` is read.
    #[cfg(feature = "sqlite")]
    pub(super) fn without_summary(name: &str, thing: &'static str) -> Self {
        Self::of(name, thing, SummaryState { trust: Trust::Absent, shift: 0, gone: 0, gone_ns: None, listed: 0 })
    }

    /// What is read, such as `frame`.
    pub(super) fn thing(&self) -> &'static str {
        self.thing
    }

    /// Notes that what is at `t_s` was whole.
    pub(super) fn saw(&mut self, t_s: f64) {
        self.whole += 1;
        self.last_s = Some(t_s);
        if self.places > 0 {
            self.before_s.get_or_insert(t_s);
        }
    }

    /// Notes that `bytes` in one place were not read.
    pub(super) fn damaged(&mut self, bytes: u64) {
        if self.places == 0 {
            self.after_s = self.last_s;
        }
        self.places += 1;
        self.bytes += bytes;
        self.damaged_to = None;
    }

    /// Notes that the file was not read from `from` to `to`; one place with what was not read before it.
    pub(super) fn damaged_from(&mut self, from: u64, to: u64) {
        if self.damaged_to == Some(from) {
            self.bytes += to - from;
        } else {
            self.damaged(to - from);
        }
        self.damaged_to = Some(to);
    }

    /// Notes that the file ends before its end, in `bytes` that are not a whole chunk; or, if `is_in_summary`, after its data.
    pub(super) fn cut(&mut self, bytes: u64, is_in_summary: bool) {
        self.cut.get_or_insert(Cut { bytes, is_in_summary });
    }

    /// Notes that everything has been read: how many the file says that it has, and how many were read, where it says so; and
    /// how many records of other programs may hold more.
    pub(super) fn end(&mut self, counts: Option<[u64; 2]>, strange: u64) {
        (self.counts, self.strange) = (counts, strange);
    }

    /// What is lost, in a line each.
    pub(super) fn losses(&self) -> Vec<String> {
        let lines = [self.cut_words(), self.damage_words()];
        let lines = lines.into_iter().flatten().chain(self.summary_words());
        lines.map(|line| format!("{}: {line}", self.name)).collect()
    }

    fn cut_words(&self) -> Option<String> {
        let cut = self.cut.as_ref()?;
        if cut.is_in_summary {
            return Some(format!("it is cut off after its data: its summary is not whole, {}", self.intact()));
        }
        let what = if cut.bytes > 0 { format!("; {} bytes of an incomplete chunk", cut.bytes) } else { String::new() };
        let missing = match self.last_s {
            Some(t_s) => format!("what came after t = {} s is missing", seconds(t_s)),
            None => format!("it has no complete {}", self.thing),
        };
        Some(format!("it is cut off: {missing}{what}"))
    }

    fn damage_words(&self) -> Option<String> {
        let Self { thing, places, bytes, .. } = self;
        let places = match places {
            0 => return None,
            1 => "one place".to_owned(),
            places => format!("{places} places, the first"),
        };
        let when = match (self.after_s, self.before_s) {
            (Some(after), Some(before)) => {
                format!("between t = {} s and t = {} s", seconds(after), seconds(before))
            }
            (Some(after), None) => format!("after t = {} s", seconds(after)),
            (None, Some(before)) => format!("before t = {} s", seconds(before)),
            (None, None) => format!("before any {thing}"),
        };
        let missing = self.missing().map_or(String::new(), |words| format!("; {words}"));
        Some(format!("damaged in {places} {when}: {bytes} bytes not read, {}{missing}", self.intact()))
    }

    fn intact(&self) -> String {
        let Self { thing, whole, .. } = self;
        match whole {
            0 => format!("no {thing} is whole"),
            1 => format!("1 {thing} is whole"),
            whole => format!("{whole} {thing}s are intact"),
        }
    }

    /// How many are missing, if the file says how many it has.
    fn missing(&self) -> Option<String> {
        let [counted, read] = self.counts?;
        Some(match counted.saturating_sub(read) {
            0 => format!("none of its {counted} {}s is missing", self.thing),
            missing => format!("{missing} of its {counted} {}s are missing", self.thing),
        })
    }

    fn summary_words(&self) -> Vec<String> {
        let Self { thing, summary, strange, .. } = self;
        let mut lines = Vec::new();
        if summary.trust == Trust::Damaged {
            lines.push(format!(
                "its summary is damaged, so nothing says whether {thing}s are missing; {}",
                self.intact()
            ));
        }
        match summary.shift {
            0 => {}
            shift if shift < 0 => lines.push(format!("{} bytes were cut out of it", shift.unsigned_abs())),
            shift => lines.push(format!("{shift} bytes were put into it")),
        }
        if summary.gone > 0 {
            let when = summary.gone_ns.map_or(String::new(), |[first, last]| {
                format!(", messages from {} s to {} s", first as f64 / 1e9, last as f64 / 1e9)
            });
            lines.push(format!(
                "{} of the {} chunks that its summary lists are not there{when}",
                summary.gone, summary.listed
            ));
        }
        match self.counts {
            Some([counted, read]) if counted < read => lines
                .push(format!("{read} {thing}s were read, and its summary counts {counted}: some may be there twice")),
            // Said with the damage.
            Some([counted, read]) if counted > read && self.places == 0 => {
                lines.extend(self.missing().map(|words| format!("{words}, {}", self.intact())));
            }
            _ => {}
        }
        if *strange > 0 {
            lines.push(format!(
                "{strange} records of other programs were passed over, and no summary says whether they hold {thing}s"
            ));
        }
        lines
    }
}
