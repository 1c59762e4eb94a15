//! A bar that fills while somebody waits at a terminal.

use std::time::{Duration, Instant};

use console::Term;

use super::screen::Screen;

/// Before this long there is nothing to wait for.
const PATIENCE: Duration = Duration::from_secs(1);
const BETWEEN_DRAWINGS: Duration = Duration::from_millis(100);
const WIDTH: usize = 40;

/// The bar, not drawn before it is worth it, and gone when it is dropped.
pub(super) struct Bar {
    doing: &'static str,
    screen: Option<Screen>,
    next: Instant,
}

impl Bar {
    /// A bar for what is said to be `doing`, from now on.
    pub(super) fn new(doing: &'static str) -> Self {
        Self { doing, screen: None, next: Instant::now() + PATIENCE }
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
        let line =
            format!("{:>3.0} %  {}{}  {}", 100.0 * share, "█".repeat(full), "░".repeat(WIDTH - full), self.doing);
        self.screen.get_or_insert_with(|| Screen::new(term)).draw(&[line]);
    }
}
