//! Sees an engine's percepts and pressures, and keeps what a plot shows of them.

use std::collections::{BTreeMap, HashMap};

use super::absences::Absences;
use super::map::PressureMap;
use super::path::Path;
use super::series::Series;
use crate::body::Body;
use crate::engine::Engine;
use crate::error::Result;
use crate::field::FieldSet;
use crate::percept::{COLUMNS, Column, Outputs, Percepts, Unit};
use crate::scene::{choose_fields, receptor_of};
use crate::signal::{Frame, Receptor};

/// Most fields that are gathered, and most that are shown.
const MAX_GATHERED: usize = 64;
const MAX_LINES: usize = 6;
const MAX_MAPS: usize = 2;
/// Most panels over time.
pub(super) const MAX_PANELS: usize = 8;
/// A longer time between two frames adds nothing to integrals over time, s.
const MAX_STEP_S: f64 = 1.0;

/// What maps and the choice of fields are made of, whatever is plotted over time.
const OF_MAPS: Outputs = Outputs::TOTAL.union(Outputs::CENTROID);

/// The outputs that an engine must give for a plot of `wanted`, or of load and area where that is empty.
#[must_use]
pub fn outputs_for(wanted: Outputs) -> Outputs {
    let usual = Outputs::TOTAL | Outputs::AREA | Outputs::named("force").unwrap_or_default();
    let panels = if wanted.is_empty() { usual } else { wanted };
    // Without a friction a ratio to it is absent for another reason.
    let friction = if panels.contains(Outputs::SLIP_RATIO) { Outputs::FRICTION } else { Outputs::empty() };
    panels | friction | OF_MAPS
}

/// The quantities that are plotted of the `fields` of `body` that these globs name, of all without any, and the outputs that an engine must
/// give for them. Plotted are those that are `wanted`; else none, which stands for load and area, or if no taxel of theirs is pressed what
/// they measure.
///
/// # Errors
/// A field has no taxels, or a glob names no field.
pub fn wanted_of(body: &Body, fields: &[String], wanted: Outputs) -> Result<[Outputs; 2]> {
    let set = FieldSet::new(body)?;
    let chosen = choose_fields(&set, fields).map_err(|e| e.at(&body.name))?;
    let members = || chosen.iter().flat_map(|&field| &set.fields[field].members);
    let has = |receptor: Receptor| members().any(|member| receptor.reads(body.taxels[member.taxel].modality));
    if has(Receptor::Sustained) {
        return Ok([wanted, outputs_for(wanted)]);
    }
    let usual = [
        (Receptor::Temperature, Outputs::TEMPERATURE | Outputs::WARMEST | Outputs::COLDEST),
        (Receptor::Proximity, Outputs::NEAREST | Outputs::APPROACH_SPEED),
    ];
    let measured =
        usual.into_iter().filter(|(receptor, _)| has(*receptor)).fold(Outputs::empty(), |all, (_, own)| all | own);
    let plotted = if wanted.is_empty() { measured } else { wanted };
    // Whoever wants pressures is told that there are none.
    Ok([plotted, (outputs_for(plotted) - OF_MAPS) | wanted])
}

/// What is plotted of one recording.
#[derive(Clone, Debug)]
pub struct Gathered {
    /// What people call the recording.
    pub(super) name: String,
    /// Number of frames.
    pub(super) frames: u64,
    /// Least and greatest time, s.
    pub(super) span_s: [f64; 2],
    /// The fields of the lines, in the order of their colours.
    pub(super) lines: Vec<String>,
    /// Whether the first of them holds all the others.
    pub(super) first_is_whole: bool,
    /// Quantities over time.
    pub(super) panels: Vec<Panel>,
    pub(super) maps: Vec<PressureMap>,
    /// What pressures are measured in.
    pub(super) p_unit: String,
}

/// A quantity over time.
#[derive(Clone, Debug)]
pub(super) struct Panel {
    pub(super) column: &'static Column,
    /// By line, a series for each component.
    pub(super) lines: Vec<Vec<Series>>,
    /// Why no line has a value.
    pub(super) why_empty: Option<&'static str>,
}

impl Panel {
    fn is_empty(&self) -> bool {
        self.lines.iter().flatten().all(|series| series.range().is_none())
    }
}

/// Gathers what is plotted of a recording.
pub struct Gatherer {
    name: String,
    frames: u64,
    span_s: Option<[f64; 2]>,
    /// Time of the frame before, s.
    last_s: Option<f64>,
    set: FieldSet,
    columns: Vec<&'static Column>,
    fields: Vec<Followed>,
    are_named: bool,
    /// By taxel of the body.
    peaks: Vec<f64>,
    integrals: Vec<f64>,
    last: Vec<f64>,
    /// By taxel of the body, whether it is pressed: others are on no map.
    are_pressed: Vec<bool>,
    /// m².
    areas: Vec<f64>,
    index_of: HashMap<u32, usize>,
    pressures: Vec<(u32, f64)>,
    p_unit: String,
}

/// A field that is followed over time, in all of its letters.
struct Followed {
    /// Its index in the body's fields.
    in_body: usize,
    /// Its index in the engine's plan by column, in the letter that gives that; and in that of pressures.
    in_plan: Vec<Option<usize>>,
    pressed: Option<usize>,
    /// Whether any column has had a value.
    is_read: bool,
    /// By column, a series for each component.
    series: Vec<Vec<Series>>,
    /// By column, of the frames in which it has no value.
    absences: Vec<Absences>,
    path: Path,
    most_load: f64,
    /// The integral of its load over time.
    impulse: f64,
}

impl Followed {
    /// Whether it was touched, or read something else that is plotted.
    fn is_shown(&self) -> bool {
        self.most_load > 0.0 || self.is_read
    }
}

impl Gatherer {
    /// For what `engine` makes of a recording called `name` on `body`; `wanted` are the outputs over time, none for load and
    /// area. If `are_named`, the fields of the engine are those that somebody wants to see.
    ///
    /// # Errors
    /// A field of the body has no taxels.
    pub fn new(name: &str, body: &Body, engine: &Engine, wanted: Outputs, are_named: bool) -> Result<Self> {
        let set = FieldSet::new(body)?;
        let shown = if wanted.is_empty() { outputs_for(wanted) - Outputs::CENTROID } else { wanted };
        let columns: Vec<&'static Column> = COLUMNS.iter().filter(|column| shown.contains(column.output)).collect();
        let index_of_name: HashMap<&str, usize> =
            set.fields.iter().enumerate().map(|(index, field)| (field.name.as_str(), index)).collect();
        let plan = engine.plan();
        let mut read_in: BTreeMap<usize, Vec<(Receptor, usize)>> = BTreeMap::new();
        for (in_plan, field) in plan.fields().enumerate() {
            let receptor = plan.letters()[plan.letter_of(in_plan)].receptor;
            let in_body = index_of_name.get(field.name).copied();
            in_body.into_iter().for_each(|in_body| read_in.entry(in_body).or_default().push((receptor, in_plan)));
        }
        let followed = |(in_body, letters): (usize, Vec<(Receptor, usize)>)| {
            let in_letter = |wanted: Receptor| letters.iter().find(|(own, _)| *own == wanted).map(|&(_, field)| field);
            Followed {
                in_body,
                in_plan: columns.iter().map(|column| in_letter(receptor_of(column))).collect(),
                pressed: in_letter(Receptor::Sustained),
                is_read: false,
                series: columns.iter().map(|column| vec![Series::default(); column.components]).collect(),
                absences: vec![Absences::default(); columns.len()],
                path: Path::default(),
                most_load: 0.0,
                impulse: 0.0,
            }
        };
        let mut fields: Vec<Followed> = read_in.into_iter().map(followed).collect();
        fields.sort_by_key(|field| (depth(&set, field.in_body), field.in_body));
        // Deeper ones only where they are the first with a chart.
        fields.retain(|field| {
            are_named
                || depth(&set, field.in_body) < 2
                || (is_charted(&set, field.in_body) && !has_charted_above(&set, field.in_body))
        });
        fields.truncate(MAX_GATHERED);
        let taxels = body.taxels.len();
        Ok(Self {
            name: name.to_owned(),
            frames: 0,
            span_s: None,
            last_s: None,
            set,
            columns,
            fields,
            are_named,
            peaks: vec![0.0; taxels],
            integrals: vec![0.0; taxels],
            last: vec![0.0; taxels],
            are_pressed: body.taxels.iter().map(|taxel| taxel.modality.is_pressed()).collect(),
            areas: body.taxels.iter().map(|taxel| taxel.area).collect(),
            index_of: body.taxels.iter().enumerate().map(|(index, taxel)| (taxel.id, index)).collect(),
            pressures: Vec::new(),
            p_unit: Unit::P.symbol().to_owned(),
        })
    }

    /// The same, with pressures in `unit`, such as `Pa`.
    #[must_use]
    pub fn with_p_unit(self, unit: &str) -> Self {
        Self { p_unit: unit.to_owned(), ..self }
    }

    /// Adds `frames`, which `engine` has just made percepts of.
    pub fn see(&mut self, engine: &Engine, frames: &[Frame]) {
        let percepts = engine.percepts();
        for (index, frame) in frames.iter().enumerate() {
            let t_s = percepts.t_s(index);
            let before = self.last_s.replace(t_s);
            self.span_s = Some(self.span_s.map_or([t_s; 2], |[least, most]| [least.min(t_s), most.max(t_s)]));
            self.frames += 1;
            let mut pressures = std::mem::take(&mut self.pressures);
            engine.pressures(frame, &mut pressures);
            let dt_s =
                before.map(|before| t_s - before).filter(|dt_s| (0.0..=MAX_STEP_S).contains(dt_s)).unwrap_or(0.0);
            if before.is_some_and(|before| t_s < before) {
                // What follows was measured before: no way leads there.
                self.fields.iter_mut().for_each(|field| field.path.push(None));
            }
            self.see_fields(percepts, index, t_s, dt_s);
            for &(id, pressure) in &pressures {
                let Some(&taxel) = self.index_of.get(&id) else { continue };
                self.peaks[taxel] = self.peaks[taxel].max(pressure);
                // The trapezoid between two frames.
                self.integrals[taxel] += 0.5 * (pressure + self.last[taxel]) * dt_s;
                self.last[taxel] = pressure;
            }
            self.pressures = pressures;
        }
    }

    fn see_fields(&mut self, percepts: &Percepts, frame: usize, t_s: f64, dt_s: f64) {
        for field in &mut self.fields {
            let quantities = self.columns.iter().zip(&mut field.series).zip(&mut field.absences);
            for (((column, series), absences), &in_plan) in quantities.zip(&field.in_plan) {
                let value = in_plan.and_then(|in_plan| percepts.value(frame, in_plan, column));
                if let (None, Some(in_plan)) = (value, in_plan) {
                    let friction = column_of(Outputs::FRICTION);
                    let has_friction = friction.is_some_and(|own| percepts.value(frame, in_plan, own).is_some());
                    absences.see(column, percepts.flags(frame, in_plan), has_friction);
                }
                field.is_read |= value.is_some() && receptor_of(column) != Receptor::Sustained;
                for (component, series) in series.iter_mut().enumerate() {
                    series.push(t_s, value.map(|value| value[component]));
                }
            }
            let [total, centroid] = [Outputs::TOTAL, Outputs::CENTROID].map(column_of);
            let value_of = |column: Option<&Column>| percepts.value(frame, field.pressed?, column?);
            let load = value_of(total).map_or(0.0, |total| total[0]);
            field.most_load = field.most_load.max(load);
            field.impulse += load * dt_s;
            field.path.push(value_of(centroid).map(|[u, v, _]| [u, v]));
        }
    }

    /// What is plotted of all that was seen.
    #[must_use]
    pub fn finish(self) -> Gathered {
        let lines = self.lines();
        let mut panels: Vec<Panel> =
            self.columns.iter().enumerate().map(|(index, column)| self.panel(index, column, &lines)).collect();
        // With a force, a total says nothing more; without a unit there is no force.
        let force = panels.iter().find(|panel| panel.column.name == "force").map(|panel| !panel.is_empty());
        match force {
            Some(true) => panels.retain(|panel| panel.column.output != Outputs::TOTAL || self.columns.len() > 3),
            Some(false) => panels.retain(|panel| panel.column.name != "force"),
            None => {}
        }
        panels.truncate(MAX_PANELS);
        let maps = self.mapped().into_iter().map(|field| {
            let followed = &self.fields[field];
            PressureMap::new(
                &self.set.fields[followed.in_body],
                followed.path.runs.clone(),
                &self.peaks,
                &self.integrals,
                &self.areas,
                &self.are_pressed,
            )
        });
        let above =
            |field: usize, below: usize| is_above(&self.set, self.fields[field].in_body, self.fields[below].in_body);
        let first_is_whole = lines.len() > 1 && lines[1..].iter().all(|&line| above(lines[0], line));
        Gathered {
            first_is_whole,
            maps: maps.collect(),
            lines: lines.iter().map(|&line| self.set.fields[self.fields[line].in_body].name.clone()).collect(),
            panels,
            p_unit: self.p_unit,
            name: self.name,
            frames: self.frames,
            span_s: self.span_s.unwrap_or([0.0; 2]),
        }
    }

    /// The quantity `index` over time, of the fields `lines`.
    fn panel(&self, index: usize, column: &'static Column, lines: &[usize]) -> Panel {
        let of_lines = lines.iter().map(|&line| self.fields[line].series[index].clone()).collect();
        let panel = Panel { column, lines: of_lines, why_empty: None };
        let mut absences = Absences::default();
        lines.iter().for_each(|&line| absences.join(&self.fields[line].absences[index]));
        Panel { why_empty: panel.is_empty().then(|| absences.most()), ..panel }
    }

    /// The fields whose lines are drawn: those that were asked for; else the topmost, and below a single one its children; and of a
    /// quantity that none of these has, such as one in a chart, the first field that has it.
    fn lines(&self) -> Vec<usize> {
        let mut lines = self.upper_lines();
        for column in 0..self.columns.len() {
            let has = |&field: &usize| self.fields[field].series[column].iter().any(|series| series.range().is_some());
            if lines.len() < MAX_LINES && !lines.iter().any(has) {
                lines.extend((0..self.fields.len()).find(has));
            }
        }
        lines
    }

    fn upper_lines(&self) -> Vec<usize> {
        let all = 0..self.fields.len();
        if self.are_named {
            return self.heaviest(all.collect(), MAX_LINES);
        }
        let level = |wanted: usize| -> Vec<usize> {
            all.clone().filter(|&field| depth(&self.set, self.fields[field].in_body) == wanted).collect()
        };
        let top = level(0);
        match top[..] {
            [only] => {
                let children = level(1).into_iter().filter(|&field| self.fields[field].is_shown()).collect();
                [vec![only], self.heaviest(children, MAX_LINES - 1)].concat()
            }
            _ => {
                let is_touched = |&field: &usize| self.fields[field].is_shown();
                let touched: Vec<usize> = top.iter().copied().filter(is_touched).collect();
                self.heaviest(if touched.is_empty() { top } else { touched }, MAX_LINES)
            }
        }
    }

    /// The fields whose maps are drawn: those with a chart that are not part of another, the heaviest.
    fn mapped(&self) -> Vec<usize> {
        let charted = (0..self.fields.len()).filter(|&field| {
            let in_body = self.fields[field].in_body;
            let is_below = |other: usize| is_above(&self.set, self.fields[other].in_body, in_body);
            let has_map = |other: usize| is_charted(&self.set, self.fields[other].in_body);
            is_charted(&self.set, in_body)
                && self.fields[field].most_load > 0.0
                && !(0..self.fields.len()).any(|other| has_map(other) && is_below(other))
        });
        self.heaviest(charted.collect(), MAX_MAPS)
    }

    /// The `most` of `fields` with the largest integrals of load over time, in their order.
    fn heaviest(&self, fields: Vec<usize>, most: usize) -> Vec<usize> {
        let mut sorted = fields;
        sorted.sort_by(|&a, &b| self.fields[b].impulse.total_cmp(&self.fields[a].impulse).then(a.cmp(&b)));
        sorted.truncate(most);
        sorted.sort_unstable();
        sorted
    }
}

fn column_of(output: Outputs) -> Option<&'static Column> {
    COLUMNS.iter().find(|column| column.output == output)
}

/// How many fields are above `field`.
fn depth(set: &FieldSet, field: usize) -> usize {
    std::iter::successors(set.fields[field].parent, |&parent| set.fields[parent].parent).count()
}

fn is_above(set: &FieldSet, above: usize, field: usize) -> bool {
    std::iter::successors(set.fields[field].parent, |&parent| set.fields[parent].parent).any(|parent| parent == above)
}

fn is_charted(set: &FieldSet, field: usize) -> bool {
    set.fields[field].chart.is_ok()
}

fn has_charted_above(set: &FieldSet, field: usize) -> bool {
    std::iter::successors(set.fields[field].parent, |&parent| set.fields[parent].parent)
        .any(|parent| is_charted(set, parent))
}

/// The lines of all recordings, each name once, with the index of its colour.
pub(super) fn colours_of(all: &[Gathered]) -> BTreeMap<String, usize> {
    let mut colours = BTreeMap::new();
    for line in all.iter().flat_map(|gathered| &gathered.lines) {
        let next = colours.len();
        colours.entry(line.clone()).or_insert(next);
    }
    colours
}
