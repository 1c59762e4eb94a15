//! What a person sees while `run` runs: the touched fields, how far a recording is, and in the end a summary.

use std::time::{Duration, Instant};

use console::{Term, style};
use somatic::internal::plain;
use somatic::signal::Letter;
use somatic::{Body, ChosenBackend, Engine, Outputs, Percept, Percepts};

use super::screen::Screen;
use super::words::{clipped, count, fitted, number, span};

mod columns;
mod on_skin;
mod senses;

use columns::{PrintedUnit, Scale};
use on_skin::TouchTable;

/// Between two drawings: as fast as reading needs, slow enough not to flicker.
const REDRAW_INTERVAL: Duration = Duration::from_millis(66);
/// How long a field that is no longer touched stays readable.
const FADE_TIME: Duration = Duration::from_millis(700);
/// Fields that a summary lists.
const MAX_SUMMARY_ROWS: usize = 40;

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum ViewKind {
    Table,
    Bar,
    Nothing,
}

/// What a view shows about a run.
pub(super) struct RunInfo<'a> {
    pub(super) engine: &'a Engine,
    pub(super) body: &'a Body,
    pub(super) source: &'a str,
    pub(super) all_fields: bool,
}

/// What is shown while frames come.
pub(super) struct View {
    screen: Option<Screen>,
    table: Option<Table>,
    pace: Progress,
    drawn: Option<Instant>,
    /// Lines below the table.
    footer: Vec<String>,
}

impl View {
    /// A table where standard output is a terminal and free, a bar where only standard error is one, for recordings.
    pub(super) fn choose(quiet: bool, stdout_taken: bool, recording: bool) -> ViewKind {
        let (out, err) = (Term::stdout(), Term::stderr());
        if quiet || console::is_dumb() {
            ViewKind::Nothing
        } else if out.is_term() {
            if stdout_taken { ViewKind::Nothing } else { ViewKind::Table }
        } else if err.is_term() && recording {
            ViewKind::Bar
        } else {
            ViewKind::Nothing
        }
    }

    pub(super) fn is_table(&self) -> bool {
        self.table.is_some()
    }

    pub(super) fn see(&mut self, percepts: &Percepts, progress: Option<f64>) {
        self.pace.see(percepts, progress);
        if let Some(table) = &mut self.table {
            table.see(percepts);
        }
    }

    fn is_due(&self) -> bool {
        self.screen.is_some() && self.drawn.is_none_or(|drawn| drawn.elapsed() >= REDRAW_INTERVAL)
    }

    /// Puts `lines` below the table, if it is time to draw.
    pub(super) fn set_footer(&mut self, lines: impl FnOnce() -> Vec<String>) {
        if self.is_due() {
            self.footer = lines();
        }
    }

    pub(super) fn draw(&mut self) {
        if !self.is_due() {
            return;
        }
        let Some(screen) = &mut self.screen else { return };
        self.drawn = Some(Instant::now());
        self.pace.tick();
        let (rows, columns) = screen.room();
        let bar = self.pace.bar(columns);
        let mut lines = Vec::new();
        // The table has at least half of the room.
        let below: Vec<String> = self.footer.iter().take(rows / 2).map(|line| clipped(line, columns)).collect();
        let room = rows.saturating_sub(usize::from(bar.is_some()) + below.len());
        if let Some(table) = &mut self.table {
            table.lines(&mut lines, &self.pace, room, columns);
        }
        lines.truncate(room);
        lines.extend(below);
        lines.extend(bar);
        screen.draw(&lines);
    }

    /// Takes the lines away and leaves a summary of the table.
    pub(super) fn finish(self) {
        drop(self.screen);
        if let Some(table) = self.table {
            // A terminal that has gone needs no summary.
            let _ = super::stdio::print(&table.summary(&self.pace));
        }
    }
}

impl ViewKind {
    pub(super) fn is_table(self) -> bool {
        self == Self::Table
    }

    pub(super) fn open(self, about: &RunInfo<'_>) -> View {
        let term = match self {
            Self::Table => Some(Term::stdout()),
            Self::Bar => Some(Term::stderr()),
            Self::Nothing => None,
        };
        View {
            screen: term.map(Screen::new),
            table: self.is_table().then(|| Table::new(about)),
            pace: Progress::new(self == Self::Bar),
            drawn: None,
            footer: Vec::new(),
        }
    }
}

struct Progress {
    on_stderr: bool,
    started: Instant,
    frames: u64,
    first_s: Option<f64>,
    last_s: f64,
    progress: Option<f64>,
    mark: (Instant, u64),
    rate: Option<f64>,
}

impl Progress {
    fn new(on_stderr: bool) -> Self {
        let now = Instant::now();
        let (frames, first_s, last_s, progress, rate) = (0, None, 0.0, None, None);
        Self { on_stderr, started: now, frames, first_s, last_s, progress, mark: (now, 0), rate }
    }

    fn see(&mut self, percepts: &Percepts, progress: Option<f64>) {
        if percepts.frames() > 0 {
            self.first_s.get_or_insert(percepts.t_s(0));
            self.last_s = percepts.t_s(percepts.frames() - 1);
            self.frames += percepts.frames() as u64;
        }
        self.progress = progress;
    }

    /// Measures the rate over a second or so, so that its digits can be read.
    fn tick(&mut self) {
        let (since, frames) = self.mark;
        let wait = if self.rate.is_some() { 1.0 } else { 0.3 };
        if since.elapsed().as_secs_f64() > wait {
            self.rate = Some((self.frames - frames) as f64 / since.elapsed().as_secs_f64());
            self.mark = (Instant::now(), self.frames);
        }
    }

    fn bar(&self, columns: usize) -> Option<String> {
        let progress = self.progress?;
        let elapsed = self.started.elapsed().as_secs_f64();
        let left = elapsed * (1.0 - progress) / progress.max(1e-9);
        let left = if elapsed > 0.4 { format!("{} left", span(left)) } else { String::new() };
        let text = if self.on_stderr {
            format!("{:>3.0} %  {}  {left}", 100.0 * progress, count(self.frames, "frame"))
        } else {
            format!("{:>3.0} %  {left}", 100.0 * progress)
        };
        let width = columns.saturating_sub(text.len() + 6).min(40);
        if width < 8 {
            return Some(clipped(&format!("  {text}"), columns));
        }
        let full = (progress * width as f64).round() as usize;
        let paint = |text: String| if self.on_stderr { style(text).for_stderr() } else { style(text) };
        let (done, rest) = (paint("━".repeat(full)).cyan(), paint("─".repeat(width - full)).dim());
        Some(format!("  {done}{rest}  {text}"))
    }
}

struct FieldRow {
    name: String,
    /// Whether being there is being touched: not of what reads a temperature.
    is_touch: bool,
    latest: Option<Percept>,
    touched_at: Option<Instant>,
    frames_touched: u64,
    largest: Option<(f64, f64)>,
}

struct Table {
    title: String,
    backend: String,
    outputs: Outputs,
    all_fields: bool,
    rows: Vec<FieldRow>,
    touches: Option<TouchTable>,
    largest_total: f64,
    unit: PrintedUnit,
    /// What positions in the world are in.
    world: String,
    in_world: bool,
    /// Rows shown at most so far: the table grows and does not shrink, or what is below would jump.
    tallest: usize,
}

impl Table {
    fn new(about: &RunInfo<'_>) -> Self {
        let ChosenBackend { name, device: what, .. } = about.engine.backend();
        let plan = about.engine.plan();
        let unit = plan.common_quantity().map_or(PrintedUnit::SI, PrintedUnit::for_quantity);
        let is_of_pressure = |letter: usize| plan.letters()[letter].receptor.is_of_pressure();
        let has_pressure = (0..plan.letters().len()).any(is_of_pressure);
        let row = |field: usize| FieldRow {
            is_touch: !has_pressure || is_of_pressure(plan.letter_of(field)),
            // What is in columns is of pressures, unless it is marked otherwise.
            name: match plan.letters()[plan.letter_of(field)] == Letter::default() {
                true => plain::line(plan.fields().nth(field).map_or("", |field| field.name)).into_owned(),
                false => plain::line(&plan.label(field)).into_owned(),
            },
            latest: None,
            touched_at: None,
            frames_touched: 0,
            largest: None,
        };
        Self {
            title: plain::line(&format!("{} ← {}", about.body.name, about.source)).into_owned(),
            backend: format!("{name}, {what}"),
            outputs: plan.outputs(),
            all_fields: about.all_fields,
            rows: (0..plan.fields().len()).map(row).collect(),
            touches: TouchTable::new(about.engine, about.body, unit),
            largest_total: 0.0,
            unit,
            world: plain::line(plan.world()).into_owned(),
            in_world: false,
            tallest: 0,
        }
    }

    fn see(&mut self, percepts: &Percepts) {
        let now = Instant::now();
        if let Some(touches) = &mut self.touches {
            touches.see(percepts);
        }
        for frame in 0..percepts.frames() {
            for percept in percepts.touched(frame) {
                let row = &mut self.rows[percept.field];
                row.frames_touched += u64::from(row.is_touch);
                row.touched_at = Some(now);
                row.latest = Some(percept);
                self.in_world |= percept.in_world;
                if let Some(total) = percept.total {
                    self.largest_total = self.largest_total.max(total);
                    if row.largest.is_none_or(|(largest, _)| total > largest) {
                        row.largest = Some((total, percepts.t_s(frame)));
                    }
                }
            }
        }
        if let Some(last) = percepts.frames().checked_sub(1) {
            for percept in percepts.frame(last).filter(|percept| !percept.contact) {
                let row = &mut self.rows[percept.field];
                // What is shown while it fades is the last touch, marked as over.
                if let Some(latest) = &mut row.latest {
                    latest.contact = false;
                }
            }
        }
    }

    fn lines(&mut self, lines: &mut Vec<String>, pace: &Progress, rows: usize, columns: usize) {
        let rate = pace.rate.map_or(String::new(), |rate| format!("   {} frames/s", number_of_frames(rate)));
        let head = format!("t {:.2} s   {}{rate}", pace.last_s, count(pace.frames, "frame"));
        let wide = |text: &str| console::measure_text_width(text);
        if wide(&head) + wide(&self.backend) + 5 <= columns {
            lines.push(format!("  {head}   {}", style(&self.backend).dim()));
        } else {
            lines.push(clipped(&format!("  {head}"), columns));
        }
        if rows >= 8 && wide(&self.title) + 2 <= columns {
            lines.insert(0, format!("  {}", style(&self.title).bold()));
        }
        if let Some(touches) = &mut self.touches {
            lines.extend(touches.lines(columns.saturating_sub(2)).into_iter().map(|line| format!("  {line}")));
        }
        let shown = |row: &&FieldRow| self.all_fields || row.touched_at.is_some_and(|at| at.elapsed() < FADE_TIME);
        let visible: Vec<&FieldRow> = self.rows.iter().filter(shown).collect();
        let longest = self.rows.iter().map(|row| wide(&row.name)).max().unwrap_or(0);
        let world = self.in_world.then_some(&*self.world);
        let layout = columns::Layout::new(longest, self.outputs, world, columns.saturating_sub(2), self.unit);
        lines.push(format!("  {}", style(layout.headings()).dim()));

        let room = rows.saturating_sub(lines.len());
        let fits = if visible.len() > room { room.saturating_sub(1) } else { visible.len() };
        for row in visible.iter().take(fits) {
            let scale = Scale { largest_total: self.largest_total, unit: self.unit };
            lines.push(format!("  {}", layout.row(&row.name, row.latest.as_ref(), scale)));
        }
        if fits < visible.len() {
            lines.push(format!("  {}", style(format!("… and {} more", visible.len() - fits)).dim()));
        }
        if visible.is_empty() && room > 0 {
            lines.push(format!("  {}", style("nothing is touched").dim()));
        }
        self.tallest = self.tallest.max(lines.len()).min(rows);
        lines.resize(self.tallest.max(lines.len()), String::new());
    }

    fn summary(&self, pace: &Progress) -> String {
        let seconds = pace.started.elapsed().as_secs_f64();
        let length = pace.first_s.map_or(0.0, |first| pace.last_s - first);
        let mut text = format!(
            "{}\n{} over {length:.2} s, in {} ({} frames/s); backend {}\n",
            style(&self.title).bold(),
            count(pace.frames, "frame"),
            span(seconds),
            number_of_frames(pace.frames as f64 / seconds.max(1e-9)),
            self.backend
        );
        if let Some(touches) = &self.touches {
            text += &touches.summary();
        }
        let touched: Vec<&FieldRow> = self.rows.iter().filter(|row| row.frames_touched > 0).collect();
        let fields = self.rows.iter().filter(|row| row.is_touch).count();
        if touched.is_empty() {
            return text + &format!("none of {} was touched\n", count(fields as u64, "field"));
        }
        let columns = usize::from(Term::stdout().size().1).saturating_sub(1);
        let longest = touched.iter().map(|row| console::measure_text_width(&row.name)).max().unwrap_or(0);
        let width = longest.max(5).min(columns.saturating_sub(46)).max(8);
        let largest = self.unit.heads("largest total");
        let wide = largest.len();
        let head = format!("{}  frames touched  {largest}      at", fitted("field", width, false));
        text += &format!("\n{}\n", style(clipped(&head, columns)).dim());
        for row in touched.iter().take(MAX_SUMMARY_ROWS) {
            let share = 100.0 * row.frames_touched as f64 / pace.frames as f64;
            text += &format!("{}  {:>8} {share:>3.0} %", fitted(&row.name, width, false), row.frames_touched);
            if let Some((total, at)) = row.largest {
                text += &format!("  {:>wide$}  {:>6}", number(total * self.unit.factor), format!("{at:.2} s"));
            }
            text += "\n";
        }
        let more = touched.len().saturating_sub(MAX_SUMMARY_ROWS);
        if more > 0 {
            text += &format!("… and {more} more\n");
        }
        let never = fields - touched.len();
        if never > 0 {
            text += &format!("{} never touched\n", count(never as u64, "field"));
        }
        text
    }
}

fn number_of_frames(rate: f64) -> String {
    if rate < 10.0 { format!("{rate:.1}") } else { format!("{rate:.0}") }
}
