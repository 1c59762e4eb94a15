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
    /// Whether any touch so far had a force, which then stands in place of the total.
    knows_forces: bool,
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
        Some(Self { links, world, unit, latest: Vec::new(), knows_forces: false, ids: BTreeSet::new(), tallest: 0 })
    }

    pub(super) fn see(&mut self, percepts: &Percepts) {
        for frame in 0..percepts.frames() {
            let Some(found) = percepts.touches(frame) else { continue };
            self.ids.extend(found.touches.iter().map(|touch| touch.id));
            self.knows_forces |= found.touches.iter().any(|touch| touch.force_newton.is_some());
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
            if self.knows_forces { "force N".to_owned() } else { self.unit.heads("total") },
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
        let load = match self.knows_forces {
            true => touch.force_newton.map_or("–".to_owned(), number),
            false => number(touch.total * self.unit.factor),
        };
        let frame = if touch.in_world { format!(" in {}", self.world) } else { String::new() };
        format!(
            "{:>6}  {}  {load:>9}  {:>24}  {speed:>9}  {:>6.1}  {}{frame}",
            touch.id,
            fitted(&self.links[touch.link as usize], width, false),
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

#[cfg(test)]
mod tests {
    use somatic::bundled;
    use somatic::scene::Scene;
    use somatic::signal::{Calibration, Quantity, RawValue};
    use somatic::{BackendKind, Options, touch};

    use super::*;

    /// The table of a touch of 1000 on one taxel of the hand.
    fn table(calibration: Option<&str>, unit: Quantity) -> String {
        let body = Body::from_bytes("hand", bundled::HAND).unwrap();
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let calibration = calibration.map(|text| Calibration::parse(text, &ids).unwrap());
        let scene = Scene::default().touches(touch::Options::default());
        let options = Options::default().backend(BackendKind::Cpu).scene(scene).calibration(calibration);
        let mut engine = Engine::new(&body, options).unwrap();
        let mut table = TouchTable::new(&engine, &body, PrintedUnit::for_quantity(unit)).unwrap();
        let mut frame = engine.frame(0.0);
        frame.values.fill(RawValue::new(0.0));
        frame.values[0] = RawValue::new(1000.0);
        table.see(engine.process_one(&frame).unwrap());
        table.lines(200).join("\n")
    }

    #[test]
    fn a_touch_has_its_force_where_that_is_known_and_else_its_total() {
        let counts = table(None, Quantity::Count);
        assert!(counts.contains("total") && counts.contains("1000"), "{counts}");
        // 1000 Pa on some ten square millimetres.
        let pascals = table(Some("[all]\nunit = \"Pa\""), Quantity::Pascal);
        assert!(pascals.contains("force N") && !pascals.contains("kPa") && pascals.contains("  0.0"), "{pascals}");
        let newtons = table(Some("[all]\nunit = \"N\""), Quantity::Newton);
        assert!(newtons.contains("force N") && newtons.contains("1000"), "{newtons}");
    }
}
