//! `somatic run --check-order`: which field or taxel answers while somebody presses one after the other.

use std::collections::{BTreeSet, HashMap};
use std::str::FromStr;

use somatic::internal::run::Opened;
use somatic::internal::signal::Quantity;
use somatic::internal::survey::press_order::{Answer, PressOrder, Reading, SensorGroup};
use somatic::{Body, Engine, Error, Frame, Plan, Result};

use crate::cli::stdio::{print, say};
use crate::cli::words::count;

/// Taxels in a row are written as one; more such rows than this are not all written.
const MAX_SPANS: usize = 8;

/// What answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OrderOf {
    /// Fields, or taxels where there is one field.
    Fields,
    Taxels,
}

impl OrderOf {
    pub(super) const WORDS: &'static [&'static str] = &["fields", "taxels"];
}

impl FromStr for OrderOf {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text {
            "fields" => Ok(Self::Fields),
            "taxels" => Ok(Self::Taxels),
            _ => Err(Error::usage(format!("there is no `{text}`; fields or taxels"))),
        }
    }
}

/// Says what is pressed, each time that changes.
pub(super) struct OrderReport {
    order: PressOrder,
    /// What a group is called, in one word.
    word: &'static str,
    quantity: Quantity,
    /// The ids of a frame's values, and the other way round.
    ids: Vec<u32>,
    places: HashMap<u32, usize>,
    is_raw: bool,
    /// Of pressures: those of one frame, by id and by place.
    by_id: Vec<(u32, f64)>,
    by_place: Vec<Option<f64>>,
    /// Whether somebody is told what to do, and has been told to press.
    is_guided: bool,
    is_pressing: bool,
}

impl OrderReport {
    /// For a run that is `opened`, in which fields are called `word`. Without a calibration, `is_raw`, values are compared with rest.
    pub(super) fn new(opened: &Opened, of: OrderOf, word: &'static str, is_raw: bool, is_live: bool) -> Self {
        let Opened { body, engine, source, .. } = opened;
        let plan = engine.plan();
        let ids = source.taxels().to_vec();
        let places: HashMap<u32, usize> = ids.iter().copied().zip(0..).collect();
        let fields = lowest_fields(body, plan, &places);
        let is_by_taxel = of == OrderOf::Taxels || fields.len() < 2;
        let groups = if is_by_taxel { taxels_of(&fields, &ids) } else { fields };
        let quantity = plan.common_quantity().filter(|_| !is_raw);
        let (reading, quantity) = match quantity {
            None => (Reading::Raw, Quantity::Count),
            Some(quantity) => reading_of(body, quantity, &ids, &groups),
        };
        let mut report = Self {
            is_raw: reading == Reading::Raw,
            order: PressOrder::new(groups, ids.len(), reading),
            word: if is_by_taxel { "taxel" } else { word },
            quantity,
            by_id: Vec::new(),
            by_place: vec![None; ids.len()],
            ids,
            places,
            is_guided: is_live,
            is_pressing: false,
        };
        report.guide();
        report
    }

    /// Tells somebody at the robot what to do, once each.
    fn guide(&mut self) {
        let was_pressing = std::mem::replace(&mut self.is_pressing, !self.order.is_at_rest());
        if !self.is_guided || (was_pressing && self.is_pressing) {
            return;
        }
        match self.is_pressing {
            true => say(&format!("now press one {} after the other; Ctrl-C when all are done", self.word)),
            false => say("leave the robot alone for 1 s"),
        }
    }

    /// Takes `frames`, which went through `engine`, and prints what is pressed.
    pub(super) fn see(&mut self, engine: &Engine, frames: &[Frame]) -> Result<()> {
        for frame in frames {
            let answer = if self.is_raw {
                self.order.see(frame.t_s, frame.values.iter().map(|value| value.number()))
            } else {
                engine.pressures(frame, &mut self.by_id);
                self.by_place.fill(None);
                for (id, pressure) in &self.by_id {
                    if let Some(&place) = self.places.get(id) {
                        self.by_place[place] = Some(*pressure);
                    }
                }
                self.order.see(frame.t_s, self.by_place.iter().copied())
            };
            if !self.is_pressing && !self.order.is_at_rest() {
                self.guide();
            }
            if let Some(answer) = answer {
                print(&format!("{}\n", self.line(&answer)))?;
            }
        }
        Ok(())
    }

    /// Prints the last press, and what never answered.
    pub(super) fn finish(mut self) -> Result<()> {
        if let Some(answer) = self.order.finish() {
            print(&format!("{}\n", self.line(&answer)))?;
        }
        print(&self.ending())
    }

    fn line(&self, answer: &Answer) -> String {
        let group = &self.order.groups()[answer.group];
        let (factor, unit) = self.quantity.readable(answer.most);
        let most = if group.sensors.len() > 1 {
            format!(", most at taxel {}", self.ids[answer.sensor])
        } else {
            String::new()
        };
        format!("{}: pressed, {} {unit}{most}", self.named(group), short(answer.most * factor))
    }

    /// What `group` is called, with its taxels.
    fn named(&self, group: &SensorGroup) -> String {
        if self.word == "taxel" {
            return format!("taxel {}", group.name);
        }
        let ids: BTreeSet<u32> = group.sensors.iter().map(|&sensor| self.ids[sensor]).collect();
        let taxels = match ids.len() {
            0 => "no taxel of it comes".to_owned(),
            1 => format!("taxel {}", spans(&ids)),
            _ => format!("taxels {}", spans(&ids)),
        };
        format!("{} \"{}\" ({taxels})", self.word, group.name)
    }

    /// What never answered, in lines.
    fn ending(&self) -> String {
        let all = self.order.groups().len();
        let silent: Vec<&SensorGroup> = self.order.silent().collect();
        if silent.is_empty() {
            return format!("all {} answered\n", count(all as u64, self.word));
        }
        let begin = format!("never answered: {} of {}", silent.len(), count(all as u64, self.word));
        if self.word == "taxel" {
            let ids: BTreeSet<u32> = silent.iter().flat_map(|group| &group.sensors).map(|&at| self.ids[at]).collect();
            return format!("{begin}: {}\n", spans(&ids));
        }
        silent.iter().fold(format!("{begin}\n"), |text, group| text + "  " + &self.named(group) + "\n")
    }
}

/// The fields of `plan` that have no others below them. `places` has the places of taxels in frames.
fn lowest_fields(body: &Body, plan: &Plan, places: &HashMap<u32, usize>) -> Vec<SensorGroup> {
    let chosen: BTreeSet<&str> = plan.fields().map(|field| field.name).collect();
    let specs = body.fields.iter().filter(|field| chosen.contains(field.name.as_str()));
    let parents: BTreeSet<&str> = specs.filter_map(|field| field.parent.as_deref()).collect();
    let mut known = BTreeSet::new();
    let own = plan.fields().enumerate().filter(|(_, field)| !parents.contains(field.name) && known.insert(field.name));
    let group = |(number, name): (usize, &str)| {
        let ids = plan.taxels_of(number).map(|taxel| body.taxels[taxel].id);
        SensorGroup { name: name.to_owned(), sensors: ids.filter_map(|id| places.get(&id).copied()).collect() }
    };
    own.map(|(number, field)| group((number, field.name))).collect()
}

/// Each taxel of `fields` by itself; `ids` are those of a frame's values.
fn taxels_of(fields: &[SensorGroup], ids: &[u32]) -> Vec<SensorGroup> {
    let sensors: BTreeSet<usize> = fields.iter().flat_map(|field| &field.sensors).copied().collect();
    sensors.into_iter().map(|at| SensorGroup { name: ids[at].to_string(), sensors: vec![at] }).collect()
}

/// How P of the quantity `quantity` is read, and what it is then: a pressure over known areas is a force, else the mean of its group.
fn reading_of(body: &Body, quantity: Quantity, ids: &[u32], groups: &[SensorGroup]) -> (Reading, Quantity) {
    let area = |id: &u32| body.taxel_index(*id).map_or(0.0, |taxel| body.taxels[taxel].area);
    let areas: Vec<f64> = ids.iter().map(area).collect();
    let are_known = groups.iter().flat_map(|group| &group.sensors).all(|&sensor| areas[sensor] > 0.0);
    match quantity {
        Quantity::Pascal if are_known => (Reading::Pressures(areas), Quantity::Newton),
        Quantity::Pascal => {
            let mut shares = vec![1.0; ids.len()];
            for group in groups {
                group.sensors.iter().for_each(|&sensor| shares[sensor] = 1.0 / group.sensors.len() as f64);
            }
            (Reading::Pressures(shares), quantity)
        }
        _ => (Reading::Pressures(vec![1.0; ids.len()]), quantity),
    }
}

/// `value` with four digits, and no zeros after the point.
fn short(value: f64) -> String {
    format!("{value:.3e}").parse().map_or_else(|_| value.to_string(), |short: f64| short.to_string())
}

/// `ids` with those in a row as one: `0-3, 7`.
fn spans(ids: &BTreeSet<u32>) -> String {
    let mut spans: Vec<[u32; 2]> = Vec::new();
    for &id in ids {
        match spans.last_mut() {
            Some([_, end]) if *end + 1 == id => *end = id,
            _ => spans.push([id, id]),
        }
    }
    let word = |[first, last]: &[u32; 2]| match first == last {
        true => first.to_string(),
        false => format!("{first}-{last}"),
    };
    let words: Vec<String> = spans.iter().take(MAX_SPANS).map(word).collect();
    let more = if spans.len() > MAX_SPANS { format!(", … of {} in all", ids.len()) } else { String::new() };
    words.join(", ") + &more
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn taxels_in_a_row_are_one_span() {
        let spans_of = |ids: &[u32]| spans(&ids.iter().copied().collect());
        assert_eq!(spans_of(&[7, 0, 1, 2, 3]), "0-3, 7");
        assert_eq!(spans_of(&[5]), "5");
        let odd: Vec<u32> = (0..30).map(|id| 2 * id).collect();
        assert_eq!(spans_of(&odd), "0, 2, 4, 6, 8, 10, 12, 14, … of 30 in all");
    }

    #[test]
    fn numbers_have_four_digits() {
        assert_eq!([4.2, 399.96, 151_234.0].map(short), ["4.2", "400", "151200"]);
    }
}
