//! Messages on serial lines while they are read, and at the end.

use std::collections::{HashMap, VecDeque};
use std::time::{Duration, Instant};

use console::style;
use serde_json::{Value, json};
use somatic::internal::run::Repeats;
use somatic::internal::signal::BoardHealth;
use somatic::internal::sink::News;
use somatic::internal::source::{BoardAccount, BoardState};
use somatic::output::OutputPath;
use somatic::source::Lines;
use somatic::{Error, Result};

use super::latency::Latency;
use super::stdio::say;
use super::words::count;

/// Number of messages shown below the table.
const LATEST_MESSAGES: usize = 3;
/// More boards than this share one row.
const MAX_BOARD_ROWS: usize = 6;

/// Time between two looks at how boards are doing.
const HEALTH_PERIOD: Duration = Duration::from_millis(500);

/// A message shown below the table.
struct Latest {
    text: String,
    /// With its time and count.
    line: String,
}

/// Collects and shows the messages of serial lines.
pub(super) struct LineReport {
    lines: Lines,
    latency: Latency,
    repeats: Repeats,
    /// Messages that came while a table was shown.
    kept: Vec<String>,
    latest: VecDeque<Latest>,
    summary: Option<OutputPath>,
    quiet: bool,
    /// News that sinks have not received.
    news: News,
    health_sent_at: Option<Instant>,
    /// By board, its frames and when there was one more.
    last_frames: HashMap<u16, (u64, Instant)>,
}

impl LineReport {
    pub(super) fn new(lines: Lines, summary: Option<OutputPath>, quiet: bool) -> Self {
        Self {
            lines,
            latency: Latency::default(),
            repeats: Repeats::default(),
            kept: Vec::new(),
            latest: VecDeque::new(),
            summary,
            quiet,
            news: News::default(),
            health_sent_at: None,
            last_frames: HashMap::new(),
        }
    }

    /// Percepts that limbs have computed since the last call, a line of NDJSON each.
    /// When each was read is beside them.
    pub(super) fn percepts(&self) -> Option<(Vec<String>, Vec<Instant>)> {
        let percepts = self.lines.percepts().into_iter().map(|percepts| (percepts.line, percepts.read_at));
        let percepts: (Vec<String>, Vec<Instant>) = percepts.unzip();
        (!percepts.0.is_empty()).then_some(percepts)
    }

    /// The news for sinks, if there is any.
    pub(super) fn news(&mut self) -> Option<News> {
        let now = Instant::now();
        if self.health_sent_at.is_none_or(|sent_at| now - sent_at >= HEALTH_PERIOD) {
            self.health_sent_at = Some(now);
            let accounts = self.lines.accounts();
            self.news.boards = Some(accounts.iter().map(|account| self.health(account, now)).collect());
        }
        let is_news = self.news.boards.is_some() || !self.news.notices.is_empty();
        is_news.then(|| std::mem::take(&mut self.news))
    }

    fn health(&mut self, account: &BoardAccount, now: Instant) -> BoardHealth {
        let (frames, at) = self.last_frames.entry(account.board).or_insert((0, now));
        if *frames != account.delivered {
            (*frames, *at) = (account.delivered, now);
        }
        BoardHealth {
            name: account.name(),
            state: account.state.word().to_owned(),
            rate_hz: account.rate_hz,
            frames: account.delivered,
            lost: account.lost,
            age_s: (account.delivered > 0).then(|| (now - *at).as_secs_f64()),
        }
    }

    /// Notes that the percepts of frames read at these times have been written.
    pub(super) fn see(&mut self, read_at: &[Instant]) {
        read_at.iter().for_each(|read_at| self.latency.see(read_at.elapsed()));
    }

    /// Shows new messages; with a table, below it and again at the end.
    pub(super) fn tell(&mut self, at_table: bool) {
        for notice in self.lines.notices() {
            let Some(line) = self.repeats.tell(notice.at_s, &notice.text) else { continue };
            self.news.notices.push((notice.at_s, notice.text.clone()));
            if !at_table {
                say(&line);
                continue;
            }
            if self.latest.len() == LATEST_MESSAGES {
                self.latest.pop_front();
            }
            self.latest.push_back(Latest { text: notice.text, line: line.clone() });
            // A line that breaks in ever other ways fills no memory.
            if self.kept.len() < 1000 {
                self.kept.push(line);
            }
        }
    }

    /// The rows below the table.
    pub(super) fn rows(&self) -> Vec<String> {
        let accounts = self.lines.accounts();
        let mut rows: Vec<String> = Vec::new();
        if accounts.len() <= MAX_BOARD_ROWS {
            rows.extend(accounts.iter().map(|account| {
                let text = format!("  {}: {}, {}", account.name(), account.state.word(), frame_counts(account));
                if account.state == BoardState::Speaking { text } else { style(text).yellow().to_string() }
            }));
        } else {
            rows.push(together(&accounts));
        }
        if !self.latency.is_empty() {
            rows.push(format!("  latency {}", self.latency.words()));
        }
        let latest = self.latest.iter().filter(|latest| !latest.is_over(&accounts));
        rows.extend(latest.map(|latest| style(format!("  {}", latest.line)).yellow().to_string()));
        rows
    }

    /// Closes the lines, says what became of them, and gives what was lost.
    pub(super) fn finish(mut self) -> Result<Vec<String>> {
        self.lines.close();
        self.kept.drain(..).for_each(|notice| say(&notice));
        self.tell(false);
        self.repeats.rest().for_each(|line| say(&line));
        let accounts = self.lines.accounts();
        let answered = accounts.iter().any(|account| account.port.is_some());
        if !self.quiet {
            for account in accounts.iter().filter(|account| account.state != BoardState::Awaited) {
                let port = account.port.as_deref().unwrap_or("?");
                let place = if account.limb.is_some() { String::new() } else { format!(" at {port}") };
                say(&format!("{}{place}: {}", account.name(), frame_counts(account)));
            }
            let awaited = accounts.iter().filter(|account| account.state == BoardState::Awaited);
            let awaited: Vec<String> = awaited.map(BoardAccount::name).collect();
            if !awaited.is_empty() && answered {
                say(&format!("no packets from: {}", awaited.join(", ")));
            }
            if !self.latency.is_empty() {
                say(&format!("from the last byte read to the percept written: {}", self.latency.words()));
            }
        }
        if let Some(summary) = self.summary.take() {
            let boards: Vec<Value> = accounts.iter().map(BoardAccount::as_json).collect();
            let text = format!("{:#}\n", json!({"boards": boards, "latency": self.latency.json()}));
            summary.write(text.as_bytes())?;
        }
        if !answered {
            let limbs: Vec<&str> = accounts.iter().filter_map(|account| account.limb.as_deref()).collect();
            return Err(Error::failed(if limbs.is_empty() {
                "no board has answered; are they powered, and the ports right? `somatic devices` shows the ports"
                    .to_owned()
            } else {
                let keys = limbs.join(", ");
                format!(
                    "no limb was heard; do they run, with the keys {keys}, and does the network reach this computer?"
                )
            }));
        }
        Ok(self.lines.losses())
    }
}

impl Latest {
    /// Whether it tells of a plug that is in again.
    fn is_over(&self, accounts: &[BoardAccount]) -> bool {
        let is_of = |port: &str| self.text.strip_prefix(port).is_some_and(|rest| rest.starts_with(": unplugged"));
        let is_back = |account: &BoardAccount| account.state != BoardState::Unplugged;
        accounts.iter().any(|account| is_back(account) && account.port.as_deref().is_some_and(is_of))
    }
}

/// What became of a board's frames, in words.
fn frame_counts(account: &BoardAccount) -> String {
    let sent = account.delivered + account.lost;
    let mut text = format!("{} sent, {} delivered, {} lost", count(sent, "frame"), account.delivered, account.lost);
    let more = [
        (account.dropped, "dropped"),
        (account.replaced, "replaced by later ones"),
        (account.corrupt, "pieces corrupt"),
        (account.unplugs, "times unplugged"),
        (account.restarts, "times started again"),
    ];
    for (number, what) in more.into_iter().filter(|(number, _)| *number > 0) {
        text += &format!(", {number} {what}");
    }
    if let Some(rate) = account.rate_hz {
        text += &format!("; {rate:.1} frames/s");
    }
    if let Some(drift) = account.drift {
        text += &format!("; clock {:+.0} ppm", drift * 1e6);
    }
    text
}

fn together(accounts: &[BoardAccount]) -> String {
    let sum = |of: fn(&BoardAccount) -> u64| accounts.iter().map(of).sum::<u64>();
    let mut text = format!(
        "  {}: {} frames sent, {} delivered, {} lost",
        count(accounts.len() as u64, if accounts[0].limb.is_some() { "limb" } else { "board" }),
        sum(|account| account.delivered + account.lost),
        sum(|account| account.delivered),
        sum(|account| account.lost)
    );
    for state in [BoardState::Silent, BoardState::Unplugged, BoardState::Awaited] {
        let ids = accounts.iter().filter(|account| account.state == state);
        let ids: Vec<String> = ids.map(|account| account.board.to_string()).collect();
        if !ids.is_empty() {
            text += &format!("; {} {}", state.word(), ids.join(", "));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plug_that_is_in_again_is_no_longer_said_to_be_out() {
        let mut account = BoardAccount::default();
        (account.port, account.state) = (Some("tty1".into()), BoardState::Unplugged);
        let latest = |text: &str| Latest { text: text.into(), line: String::new() };
        let gone = latest("tty1: unplugged; waiting for it to come back");
        assert!(!gone.is_over(&[account.clone()]));
        account.state = BoardState::Silent;
        assert!(gone.is_over(&[account.clone()]));
        assert!(!latest("tty1: board 1 is back").is_over(&[account.clone()]));
        assert!(!latest("tty12: unplugged").is_over(&[account]));
    }
}
