//! Some lines at the bottom of a terminal that are drawn again and again.

use console::Term;

use super::stdio::for_terminal;

/// Lines drawn over what this drew before; gone, and the cursor back, when it is dropped.
pub(super) struct Screen {
    term: Term,
    on_stderr: bool,
    /// Width of each line on the screen, in columns.
    drawn: Vec<usize>,
}

impl Screen {
    pub(super) fn new(term: Term) -> Self {
        let _ = term.hide_cursor();
        let on_stderr = matches!(term.target(), console::TermTarget::Stderr);
        Self { term, on_stderr, drawn: Vec::new() }
    }

    /// Rows and columns that lines may fill: one less than there are, so that nothing scrolls or wraps.
    pub(super) fn room(&self) -> (usize, usize) {
        let (rows, columns) = self.term.size();
        (usize::from(rows).saturating_sub(1).max(1), usize::from(columns).saturating_sub(1).max(1))
    }

    /// Draws `lines`, which fit into the room, instead of those before.
    pub(super) fn draw(&mut self, lines: &[String]) {
        // In one write, and between marks that let a terminal show it at once.
        let mut text = format!("\x1b[?2026h{}", self.way_back());
        for line in lines {
            text += &for_terminal(line, self.on_stderr);
            text += "\x1b[K\n";
        }
        text += "\x1b[J\x1b[?2026l";
        let _ = self.term.write_str(&text);
        self.drawn = lines.iter().map(|line| console::measure_text_width(line)).collect();
    }

    /// To the start of the first line. Lines wider than the terminal has become are wrapped by it.
    fn way_back(&self) -> String {
        let (rows, columns) = self.term.size();
        let columns = usize::from(columns).max(1);
        let up: usize = self.drawn.iter().map(|width| width.div_ceil(columns).max(1)).sum();
        match up.min(usize::from(rows).saturating_sub(1)) {
            0 => "\r".to_owned(),
            up => format!("\r\x1b[{up}A"),
        }
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = self.term.write_str(&format!("{}\x1b[J", self.way_back()));
        let _ = self.term.show_cursor();
    }
}
