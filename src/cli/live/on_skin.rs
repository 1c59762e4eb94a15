//! The touches of the whole body in the live table, above the fields.

use std::collections::BTreeSet;

use console::style;
use somatic::internal::plain;
use somatic::{Body, Engine, Percepts, Touch, TouchFlags};

use super::columns::PrintedUnit;
use crate::cli::words::{clipped, fitted, millimetres, number};

/// Touches that have a line.
const MOST: usize = 8;
/// Width of a link's name at most.
const MAX_LINK_WIDTH: usize = 24;

/// The touches of the last frame, and how many there were.
pub(super) struct TouchTable {
    links: Vec<String>,
    world: String,
    unit: PrintedUnit,
    latest: Vec<Touch>,
    ids: BTreeSet<u64>,
    /// Lines so far: what is below does not jump.
    tallest: usize,
}

impl TouchTable {
    /// `None` where the engine looks for no touches of the whole body.
    pub(super) fn new(engine: &Engine, body: &Body, unit: PrintedUnit) -> Option<Self> {
        engine.skin()?;
        let links = body.links.iter().map(|link| plain::line(&link.name).into_owned()).collect();
        let world = plain::line(engine.plan().world()).into_owned();
        Some(Self { links, world, unit, latest: Vec::new(), ids: BTreeSet::new(), tallest: 0 })
    }

    pub(super) fn see(&mut self, percepts: &Percepts) {
        for frame in 0..percepts.frames() {
            let Some(found) = percepts.touches(frame) else { continue };
            self.ids.extend(found.touches.iter().map(|touch| touch.id));
            if frame + 1 == percepts.frames() {
                self.latest.clone_from(&found.touches);
            }
        }
    }

    /// A heading and a line for each touch, at most `columns` wide.
    pub(super) fn lines(&mut self, columns: usize) -> Vec<String> {
        let width = self.links.iter().map(|link| console::measure_text_width(link)).max().unwrap_or(0);
        let width = width.clamp(4, MAX_LINK_WIDTH);
        let heading = format!(
            "{}  {}  {:>9}  {:>24}  {:>9}  {:>6}",
            fitted("touch", 6, true),
            fitted("on", width, false),
            self.unit.heads("total"),
            "at x, y, z mm",
            "mm/s",
            "s"
        );
        let mut lines = vec![style(clipped(&heading, columns)).dim().to_string()];
        lines.extend(self.latest.iter().take(MOST).map(|touch| clipped(&self.line(touch, width), columns)));
        if self.latest.is_empty() {
            lines.push(style("no touch").dim().to_string());
        }
        if self.latest.len() > MOST {
            lines.push(style(format!("… and {} more", self.latest.len() - MOST)).dim().to_string());
        }
        lines.push(String::new());
        self.tallest = self.tallest.max(lines.len());
        lines.resize(self.tallest, String::new());
        lines
    }

    fn line(&self, touch: &Touch, width: usize) -> String {
        let [x, y, z] = touch.best_place().to_array().map(millimetres);
        let speed = touch.velocity.map_or("–".to_owned(), |velocity| millimetres(velocity.length()));
        let flags = touch.flags - TouchFlags::YOUNG - TouchFlags::NO_UNIT;
        let frame = if touch.in_world { format!(" in {}", self.world) } else { String::new() };
        format!(
            "{:>6}  {}  {:>9}  {:>24}  {speed:>9}  {:>6.1}  {}{frame}",
            touch.id,
            fitted(&self.links[touch.link as usize], width, false),
            number(touch.total * self.unit.factor),
            format!("{x}, {y}, {z}"),
            touch.age_s,
            flags.names().collect::<Vec<_>>().join(" "),
        )
    }

    /// How many touches there were, in a line.
    pub(super) fn summary(&self) -> String {
        let things = if self.ids.len() == 1 { "touch" } else { "touches" };
        format!("{} {things} of the whole body\n", self.ids.len())
    }
}
