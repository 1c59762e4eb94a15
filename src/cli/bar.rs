//! A progress bar at a terminal.

use std::time::{Duration, Instant};

use console::Term;

use super::screen::Screen;
use super::words::span;

/// Shorter work shows no bar.
const SHOW_AFTER: Duration = Duration::from_secs(1);
const REDRAW_INTERVAL: Duration = Duration::from_millis(100);
const WIDTH: usize = 40;

/// A progress bar, cleared when dropped.
pub(super) struct Bar {
    doing: &'static str,
    screen: Option<Screen>,
    next: Instant,
    begun: Instant,
    /// The remaining time in words.
    left: Option<String>,
}

impl Bar {
    /// Starts a bar labelled `doing`.
    pub(super) fn new(doing: &'static str) -> Self {
        let now = Instant::now();
        Self { doing, screen: None, next: now + SHOW_AFTER, begun: now, left: None }
    }

    /// As [`Self::show`], with the remaining time.
    pub(super) fn show_with_time_left(&mut self, share: f64) {
        let took = self.begun.elapsed().as_secs_f64();
        self.left = (share > 0.02).then(|| format!(", {} left", span(took * (1.0 - share) / share)));
        self.show(share);
    }

    /// Shows that `share` is done, if standard error is a terminal and a redraw is due.
    pub(super) fn show(&mut self, share: f64) {
        if Instant::now() < self.next {
            return;
        }
        self.next = Instant::now() + REDRAW_INTERVAL;
        let term = Term::stderr();
        if !term.is_term() {
            return;
        }
        let share = share.clamp(0.0, 1.0);
        let full = (share * WIDTH as f64).round() as usize;
        let left = self.left.as_deref().unwrap_or_default();
        let (full, rest) = ("█".repeat(full), "░".repeat(WIDTH - full));
        let line = format!("{:>3.0} %  {full}{rest}  {}{left}", 100.0 * share, self.doing);
        self.screen.get_or_insert_with(|| Screen::new(term)).draw(&[line]);
    }
}
