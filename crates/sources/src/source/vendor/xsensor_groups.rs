//! XSENSOR's groups of cells. The file prints the values of a group's cells once more, in an order of its own and without their places:
//! which cells they are shows as the same values come together in every frame.

use std::collections::{BTreeSet, HashMap};

use super::layout::Panel;
use super::text::Cells;
use crate::signal::RawValue;

/// So many cells may have a value together, or it does not tell which one it is of.
const MOST_CANDIDATES: usize = 64;

/// The groups of a recording.
#[derive(Default)]
pub(super) struct Groups {
    known: Vec<Group>,
    /// The one whose lines come.
    current: Option<usize>,
}

struct Group {
    /// The number in the file.
    number: u32,
    name: String,
    /// In this frame.
    values: Vec<f64>,
    /// By value in its order, the cells that it may be of; `None` before it was other than 0.
    candidates: Vec<Option<Vec<u32>>>,
    /// Whether it has always had as many values.
    is_sound: bool,
}

impl Groups {
    pub(super) fn is_empty(&self) -> bool {
        self.known.is_empty()
    }

    /// The lines of group `number` come.
    pub(super) fn begin(&mut self, number: u32) {
        let known = self.known.iter().position(|group| group.number == number);
        let at = known.unwrap_or_else(|| {
            let (name, values, candidates) = (format!("group {number}"), Vec::new(), Vec::new());
            self.known.push(Group { number, name, values, candidates, is_sound: true });
            self.known.len() - 1
        });
        self.known[at].values.clear();
        self.current = Some(at);
    }

    /// The group is called `name`.
    pub(super) fn name(&mut self, name: &str) {
        if let Some(at) = self.current.filter(|_| !name.trim().is_empty()) {
            name.trim().clone_into(&mut self.known[at].name);
        }
    }

    /// More of its values.
    pub(super) fn values(&mut self, cells: Cells<'_>) {
        let Some(group) = self.current.and_then(|at| self.known.get_mut(at)) else { return };
        for word in cells {
            match word.number() {
                Some(value) => group.values.push(value),
                // Blanks after the last one of a shorter line.
                None if word.is_empty() => {}
                None => group.is_sound = false,
            }
            if group.values.len() as u64 > super::layout::MAX_CELLS {
                group.values.clear();
                group.is_sound = false;
                return;
            }
        }
    }

    /// A frame is complete, whose cells have `values`.
    pub(super) fn frame(&mut self, values: &[RawValue]) {
        self.current = None;
        let mut by_value = None;
        for group in self.known.iter_mut().filter(|group| !group.values.is_empty()) {
            group.see(values, &mut by_value);
        }
    }

    /// The parts of `panels`, whose ids go on from 0 in the order of the values; and all of it in words.
    pub(super) fn parts(&self, panels: &mut [Panel]) -> String {
        let mut said = Vec::new();
        for group in &self.known {
            let cells = group.cells();
            for panel in panels.iter_mut() {
                let of_panel = |id: &u32| panel.cells.first().is_some_and(|first| first.id <= *id);
                let is_within = |id: &u32| panel.cells.last().is_some_and(|last| *id <= last.id);
                let ids: Vec<u32> = cells.iter().copied().filter(|id| of_panel(id) && is_within(id)).collect();
                if ids.is_empty() {
                    continue;
                }
                let name = unique(&part_name(&group.name, &panel.name), panel);
                said.push(format!("{}/{name} ({} of {} cells)", panel.name, ids.len(), group.candidates.len()));
                panel.parts.push((name, ids));
            }
            if cells.is_empty() {
                said.push(format!("none of `{}`", super::text::shortened(&group.name)));
            }
        }
        format!("fields of its groups, of cells that are ever pressed: {}", said.join(", "))
    }
}

/// By value as bits, the cells that have it, and one more than [`MOST_CANDIDATES`] at most.
type ByValue = HashMap<u64, Vec<u32>>;

fn by_value(cells: &[RawValue]) -> ByValue {
    let mut all = ByValue::new();
    for (index, value) in (0..).zip(cells) {
        if let Some(value) = value.number().filter(|value| *value != 0.0) {
            let of_it = all.entry(value.to_bits()).or_default();
            if of_it.len() <= MOST_CANDIDATES {
                of_it.push(index);
            }
        }
    }
    all
}

impl Group {
    fn see(&mut self, cells: &[RawValue], all: &mut Option<ByValue>) {
        if self.candidates.is_empty() {
            self.candidates = vec![None; self.values.len()];
        }
        self.is_sound &= self.candidates.len() == self.values.len();
        let has = |cell: u32, value: f64| {
            cells.get(cell as usize).and_then(|cell| cell.number()).is_some_and(|own| own == value)
        };
        for (candidates, &value) in self.candidates.iter_mut().zip(&self.values) {
            // As cells have it.
            let value = f64::from(value as f32);
            match candidates {
                Some(known) => known.retain(|&cell| has(cell, value)),
                None if value != 0.0 => {
                    let of_it = all.get_or_insert_with(|| by_value(cells)).get(&value.to_bits());
                    *candidates = match of_it {
                        Some(cells) if cells.len() > MOST_CANDIDATES => None,
                        Some(cells) => Some(cells.clone()),
                        None => Some(Vec::new()),
                    };
                }
                None => {}
            }
        }
        self.values.clear();
    }

    /// The cells that are known for sure.
    fn cells(&self) -> BTreeSet<u32> {
        let sure = |candidates: &Option<Vec<u32>>| match candidates.as_deref() {
            Some([one]) => Some(*one),
            _ => None,
        };
        if self.is_sound { self.candidates.iter().filter_map(sure).collect() } else { BTreeSet::new() }
    }
}

/// What the part of `panel` is called that the file calls `name`: `Left Heel` of the panel `left` is `heel`.
fn part_name(name: &str, panel: &str) -> String {
    let whole = name.to_lowercase();
    let mut words: Vec<&str> = whole.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    if words.len() > 1 && words[0] == panel {
        words.remove(0);
    }
    if words.is_empty() { "group".to_owned() } else { words.join("_") }
}

/// `name`, with a number after it where `panel` has such a part already.
fn unique(name: &str, panel: &Panel) -> String {
    let is_free = |name: &String| !panel.parts.iter().any(|(known, _)| known == name);
    let numbered = (2..).map(|number| format!("{name}_{number}"));
    std::iter::once(name.to_owned()).chain(numbered).find(is_free).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::super::layout::Cell;
    use super::super::text::Separator;
    use super::*;

    #[test]
    fn cells_of_groups_are_those_whose_values_come_together() {
        let mut groups = Groups::default();
        let mut see = |cells: [f64; 4], of_groups: [&str; 2]| {
            for (number, values) in (1..).zip(of_groups) {
                groups.begin(number);
                groups.name(["Left Heel", "Both / toes"][number as usize - 1]);
                groups.values(Separator::One(b',').cells(values.as_bytes()));
            }
            groups.frame(&cells.map(RawValue::new));
        };
        // 5 is in two cells at first; the third value of the second group is never pressed.
        see([5.0, 5.0, 7.25, 0.0], ["5,0", "5,7.25,0,,"]);
        see([5.0, 6.0, 0.0, 0.0], ["5,0", "6,0,0"]);
        let panel = |name: &str, ids: [u32; 2]| Panel {
            name: name.to_owned(),
            cells: ids.map(|id| Cell { id, ..Cell::default() }).to_vec(),
            ..Panel::default()
        };
        let mut panels = [panel("left", [0, 1]), panel("right", [2, 3])];
        let said = groups.parts(&mut panels);
        assert_eq!(panels[0].parts, [("heel".to_owned(), vec![0]), ("both_toes".to_owned(), vec![1])]);
        assert_eq!(panels[1].parts, [("both_toes".to_owned(), vec![2])]);
        assert!(said.contains("left/heel (1 of 2 cells)") && said.contains("right/both_toes (1 of 3 cells)"), "{said}");
    }

    #[test]
    fn a_group_whose_values_are_of_other_cells_in_another_frame_is_none() {
        let mut groups = Groups::default();
        for (cells, values) in [([1.0, 2.0], "1,2"), ([1.0, 2.0], "2,1")] {
            groups.begin(1);
            groups.values(Separator::One(b',').cells(values.as_bytes()));
            groups.frame(&cells.map(RawValue::new));
        }
        assert!(!groups.is_empty() && groups.known[0].cells().is_empty());
        // Nor is one that has more values than before.
        let mut groups = Groups::default();
        for values in ["1,2", "1,2,3"] {
            groups.begin(1);
            groups.values(Separator::One(b',').cells(values.as_bytes()));
            groups.frame(&[1.0, 2.0].map(RawValue::new));
        }
        assert!(groups.known[0].cells().is_empty());
    }
}
