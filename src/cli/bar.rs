//! A bar that fills while somebody waits at a terminal.

use std::time::{Duration, Instant};

use console::Term;

use super::screen::Screen;
use super::words::span;

/// Before this long there is nothing to wait for.
const PATIENCE: Duration = Duration::from_secs(1);
const BETWEEN_DRAWINGS: Duration = Duration::from_millis(100);
const WIDTH: usize = 40;

/// The bar, not drawn before it is worth it, and gone when it is dropped.
pub(super) struct Bar {
    doing: &'static str,
    screen: Option<Screen>,
    next: Instant,
    begun: Instant,
    /// What is said of the time that is left.
    left: Option<String>,
}

impl Bar {
    /// A bar for what is said to be `doing`, from now on.
    pub(super) fn new(doing: &'static str) -> Self {
        let now = Instant::now();
        Self { doing, screen: None, next: now + PATIENCE, begun: now, left: None }
    }

    /// The same, with the time that is left at this pace.
    pub(super) fn show_with_time_left(&mut self, share: f64) {
        let took = self.begun.elapsed().as_secs_f64();
        self.left = (share > 0.02).then(|| format!(", {} left", span(took * (1.0 - share) / share)));
        self.show(share);
    }

    /// Shows that `share` is done, if standard error is a terminal and it is time to draw.
    pub(super) fn show(&mut self, share: f64) {
        if Instant::now() < self.next {
            return;
        }
        self.next = Instant::now() + BETWEEN_DRAWINGS;
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
