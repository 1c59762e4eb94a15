//! Holding a single-precision backend to the reference, value by value, by derived bounds.

use std::collections::BTreeMap;
use std::fmt;

use glam::{DVec2, DVec3};

use super::bounds::CellBound;
use crate::percept::{COLUMNS, Column, Flags, Measure, Outputs, Percept, Percepts};
use crate::stage::POSE_ROUNDING;
use crate::stage::angle::{between_directions, between_lines};
use crate::stage::limit::Limit;

/// How a backend's percepts compare with the reference's on the same input.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Agreement {
    /// Percepts (a field in a frame) looked at.
    pub percepts: u64,
    /// Touches of the whole body (a touch in a frame) looked at.
    pub touches: u64,
    /// Per quantity, what came of comparing it: every output under its name, `flags` and `contact`; of touches with `touches.` before
    /// the name, and `touches` itself, which is the choice of their taxels and ids.
    pub quantities: BTreeMap<String, Comparison>,
    /// Percepts and touches in which a value differs.
    pub failed: u64,
    /// The first of those, in words.
    pub failures: Vec<String>,
}

/// The result of comparing one quantity. Every value of the backend or the reference is counted once: compared, too close to
/// call, or not compared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Comparison {
    /// Values compared.
    pub compared: u64,
    /// Values that agree: within their bounds, or equal if they have no bound.
    pub agreeing: u64,
    /// Values that are not compared, because they depend on a choice that is too close to call: the reference's margin is smaller
    /// than the choice's bound. For flags it counts the sets with such a flag; the other flags of a set are compared.
    pub too_close: u64,
    /// Values that are not compared, because they depend on a value of the frame before that was too close to call and is not an
    /// output: motion from a centroid that nobody asked for.
    pub not_compared: u64,
    /// Largest error, in the quantity's unit.
    pub worst_error: f64,
    /// Largest error, as a share of its bound: over 1 is a disagreement.
    pub worst_share: f64,
}

impl Comparison {
    /// All values that the backend or the reference has.
    #[must_use]
    pub fn values(&self) -> u64 {
        self.compared + self.too_close + self.not_compared
    }

    fn add(&mut self, more: &Self) {
        self.compared += more.compared;
        self.agreeing += more.agreeing;
        self.too_close += more.too_close;
        self.not_compared += more.not_compared;
        self.worst_error = self.worst_error.max(more.worst_error);
        self.worst_share = self.worst_share.max(more.worst_share);
    }
}

impl Agreement {
    /// Whether nothing differs.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.failed == 0
    }

    /// All quantities together.
    #[must_use]
    pub fn whole(&self) -> Comparison {
        let mut whole = Comparison::default();
        self.quantities.values().for_each(|comparison| whole.add(comparison));
        whole
    }

    /// Adds what another batch gave.
    pub fn merge(&mut self, other: Self) {
        self.percepts += other.percepts;
        self.touches += other.touches;
        self.failed += other.failed;
        self.failures.extend(other.failures);
        self.failures.truncate(MOST_WORDS);
        for (name, more) in other.quantities {
            self.quantities.entry(name).or_default().add(&more);
        }
    }
}

impl fmt::Display for Agreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let whole = self.whole();
        let verdict = match whole.compared {
            _ if !self.holds() => "DISAGREES",
            0 => "could not be compared",
            _ => "agrees",
        };
        let plural = |count: u64| if count == 1 { "" } else { "s" };
        let (values, percepts) = (whole.values(), self.percepts);
        let different = whole.compared - whole.agreeing;
        write!(f, "{verdict} with the reference: of {values} value{}", plural(values))?;
        write!(f, " in {percepts} percept{}", plural(percepts))?;
        if self.touches > 0 {
            let among = if self.touches == 1 { "touch" } else { "touches" };
            write!(f, " and {} {among}", self.touches)?;
        }
        write!(f, ", {} agreeing, {different} different", whole.agreeing)?;
        write!(f, ", {} too close to call, {} not compared", whole.too_close, whole.not_compared)?;
        if whole.not_compared > 0 {
            write!(f, ", as motion depends on an earlier centroid that was too close to call")?;
        }
        for (name, c) in &self.quantities {
            let different = c.compared - c.agreeing;
            write!(f, "\n  {name:<22} {} agreeing, {different} different", c.agreeing)?;
            write!(f, ", {} too close, {} not compared", c.too_close, c.not_compared)?;
            if c.worst_error > 0.0 {
                write!(f, "; worst error {:.1e}, {:.0} % of its bound", c.worst_error, 100.0 * c.worst_share)?;
            }
            if Outputs::named(name).is_some_and(|output| OF_HOST.contains(output)) {
                write!(f, "; the same code on every backend")?;
            }
        }
        for failure in &self.failures {
            write!(f, "\n  {failure}")?;
        }
        Ok(())
    }
}

/// What is made of raw values in double precision by one code for all backends: that both sides agree says that nothing was lost.
const OF_HOST: Outputs =
    Outputs::of_stage("shear").union(Outputs::of_stage("temperature")).union(Outputs::of_stage("proximity"));

/// Disagreements that are put in words; the rest is counted.
const MOST_WORDS: usize = 10;

/// Compares `candidate` with `reference`, whose cells may differ by `bounds`.
pub(crate) fn compare(
    reference: &Percepts,
    bounds: &[CellBound],
    candidate: &Percepts,
    names: &[impl fmt::Display],
) -> Agreement {
    let mut agreement = Agreement::default();
    for frame in 0..reference.frames() {
        for (field, name) in names.iter().enumerate() {
            let bound = &bounds[frame * names.len() + field];
            let mut cell = Cell { quantities: &mut agreement.quantities, failure: None };
            cell.compare(&reference.get(frame, field), bound, &candidate.get(frame, field));
            let failure = cell.failure;
            agreement.percepts += 1;
            if let Some(what) = failure {
                agreement.failed += 1;
                if agreement.failures.len() < MOST_WORDS {
                    agreement.failures.push(format!("frame {}, `{name}`: {what}", reference.frame_number(frame)));
                }
            }
        }
    }
    agreement
}

/// An output of a percept beside the reference's.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ComparedColumn {
    /// The output.
    pub column: &'static Column,
    /// What the backend has, its components first.
    pub value: Option<[f64; 3]>,
    /// What the reference has.
    pub reference: Option<[f64; 3]>,
    /// How far they may be apart; of a centroid each coordinate, the larger of the two bounds.
    pub bound: Option<f64>,
    /// What came of comparing them.
    pub verdict: Verdict,
}

/// What came of comparing one value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Verdict {
    /// It is within its bound.
    Agrees,
    /// It is not.
    Differs,
    /// The reference's own margin to a choice is below the bound of that choice.
    TooClose,
    /// It depends on a value of the frame before that was too close to call and is not an output.
    NotCompared,
}

/// The outputs that `right` or `got` has, which may differ by `bound`.
pub(crate) fn compare_columns(right: &Percept, bound: &CellBound, got: &Percept) -> Vec<ComparedColumn> {
    let mut quantities = BTreeMap::new();
    Cell { quantities: &mut quantities, failure: None }.compare(right, bound, got);
    let compared = |column: &'static Column| {
        let comparison = quantities.get(column.name).filter(|comparison| comparison.values() > 0)?;
        let limit = match (column.measure, bound.centroid) {
            (Measure::Place, Limit::Within([u, v])) => Limit::Within(u.max(v)),
            (Measure::Place, _) => Limit::TooClose,
            _ => bound.limit(column.output),
        };
        Some(ComparedColumn {
            column,
            value: got.value(column),
            reference: right.value(column),
            bound: if let Limit::Within(bound) = limit { Some(bound) } else { None },
            verdict: match comparison {
                Comparison { too_close: 1.., .. } => Verdict::TooClose,
                Comparison { not_compared: 1.., .. } => Verdict::NotCompared,
                _ if comparison.agreeing == comparison.compared => Verdict::Agrees,
                _ => Verdict::Differs,
            },
        })
    };
    COLUMNS.iter().filter_map(compared).collect()
}

struct Cell<'a> {
    quantities: &'a mut BTreeMap<String, Comparison>,
    failure: Option<String>,
}

fn distance(a: &f64, b: &f64) -> f64 {
    (a - b).abs()
}

fn apart(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    DVec2::from_array(*a).distance(DVec2::from_array(*b))
}

fn apart_in_space(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    DVec3::from_array(*a).distance(DVec3::from_array(*b))
}

/// By how much the rounding of f64 in poses and far origins adds to a bound on places, on both sides.
fn far(limit: Limit, place: Option<[f64; 3]>) -> Limit {
    limit.map(|bound| bound + place.map_or(0.0, |place| POSE_ROUNDING * DVec3::from_array(place).length()))
}

impl Cell<'_> {
    fn fail(&mut self, what: String) {
        self.failure.get_or_insert(what);
    }

    fn compare(&mut self, right: &Percept, bound: &CellBound, got: &Percept) {
        self.compare_flags(right, bound, got);
        for column in COLUMNS {
            let (of_right, of_got) = (right.value(column), got.value(column));
            let limit = bound.limit(column.output);
            if column.measure == Measure::Place {
                let pair = |value: Option<[f64; 3]>| value.map(|[u, v, _]| [u, v]);
                self.place(column.name, pair(of_right), pair(of_got), bound.centroid);
                continue;
            }
            if column.output == Outputs::POSITION {
                self.position(column, (of_right, of_got), limit, right.in_world != got.in_world);
            } else {
                self.column(column, (of_right, of_got), limit);
            }
        }
        self.centroid_is_apart(right, bound, got);
    }

    /// Values of `column`, by its measure.
    fn column(&mut self, column: &Column, (right, got): (Option<[f64; 3]>, Option<[f64; 3]>), limit: Limit) {
        let scalar = |value: Option<[f64; 3]>| value.map(|[value, ..]| value);
        let between: fn(&f64, &f64) -> f64 = match column.measure {
            Measure::Line => |a, b| between_lines(*a, *b),
            Measure::Direction => |a, b| between_directions(*a, *b),
            _ => distance,
        };
        match column.components {
            1 => self.quantity(column.name, scalar(right), scalar(got), limit, between),
            _ => self.quantity(column.name, right, got, limit, apart_in_space),
        }
    }

    fn compare_flags(&mut self, right: &Percept, bound: &CellBound, got: &Percept) {
        let certain = !bound.in_doubt;
        let equal = !(right.flags ^ got.flags).intersects(certain);
        if !equal {
            let names = |flags: Flags| (flags & certain).names().collect::<Vec<_>>().join(" ");
            self.fail(format!("flags [{}], but the reference has [{}]", names(got.flags), names(right.flags)));
        }
        // A set with a flag in doubt is too close to call, but for a certain one that differs.
        let flags = if equal && !bound.in_doubt.is_empty() { Limit::TooClose } else { Limit::Within(()) };
        self.choice("flags", flags, equal);
        let contact = if bound.in_doubt.contains(Flags::NO_CONTACT) { Limit::TooClose } else { Limit::Within(()) };
        self.choice("contact", contact, right.contact == got.contact);
        if contact == Limit::Within(()) && right.contact != got.contact {
            self.fail(format!("contact is {}, not {}", got.contact, right.contact));
        }
    }

    /// Positions; one in another frame of coordinates is another place, wherever that is.
    fn position(
        &mut self,
        column: &Column,
        (right, got): (Option<[f64; 3]>, Option<[f64; 3]>),
        limit: Limit,
        elsewhere: bool,
    ) {
        let between = |a: &[f64; 3], b: &[f64; 3]| if elsewhere { f64::INFINITY } else { apart_in_space(a, b) };
        self.quantity(column.name, right, got, far(limit, right), between);
    }

    /// Each coordinate has a bound; the error of a centroid is the distance, up to √2 times as much.
    fn centroid_is_apart(&mut self, right: &Percept, bound: &CellBound, got: &Percept) {
        if let (Some(right), Some(got), Limit::Within(_)) = (&right.centroid, &got.centroid, bound.centroid) {
            let comparison = self.quantities.entry(name(Outputs::CENTROID)).or_default();
            comparison.worst_error = comparison.worst_error.max(apart(right, got));
        }
    }

    /// A choice, which every percept has: whether it is `equal`.
    fn choice(&mut self, name: &str, limit: Limit<()>, equal: bool) {
        let comparison = self.quantities.entry(name.to_owned()).or_default();
        match limit {
            Limit::Within(()) => {
                comparison.compared += 1;
                comparison.agreeing += u64::from(equal);
            }
            Limit::TooClose => comparison.too_close += 1,
            Limit::Unread => comparison.not_compared += 1,
        }
    }

    /// A place on a chart, each coordinate by its own bound.
    fn place(&mut self, name: &str, right: Option<[f64; 2]>, got: Option<[f64; 2]>, limit: Limit<[f64; 2]>) {
        // The coordinate that takes more of its bound stands for both.
        let (mut axis, mut most) = (0, f64::NEG_INFINITY);
        if let (Some(right), Some(got), Limit::Within(bounds)) = (right, got, limit) {
            for index in 0..2 {
                let share = share(distance(&right[index], &got[index]), bounds[index]);
                if share.is_nan() || share > most {
                    (axis, most) = (index, if share.is_nan() { f64::INFINITY } else { share });
                }
            }
        }
        self.quantity(name, right, got, limit.map(|bounds| bounds[axis]), |a, b| distance(&a[axis], &b[axis]));
    }

    fn quantity<T: fmt::Debug + Copy>(
        &mut self,
        name: &str,
        right: Option<T>,
        got: Option<T>,
        limit: Limit,
        distance: impl Fn(&T, &T) -> f64,
    ) {
        if right.is_none() && got.is_none() {
            return;
        }
        if !self.quantities.contains_key(name) {
            self.quantities.insert(name.to_owned(), Comparison::default());
        }
        let Some(comparison) = self.quantities.get_mut(name) else { return };
        let bound = match limit {
            Limit::TooClose => {
                comparison.too_close += 1;
                return;
            }
            Limit::Unread => {
                comparison.not_compared += 1;
                return;
            }
            Limit::Within(bound) => bound,
        };
        comparison.compared += 1;
        let (Some(of_reference), Some(of_backend)) = (&right, &got) else {
            self.fail(format!("{name} is {}, not {}", shown(&got), shown(&right)));
            return;
        };
        let error = distance(of_reference, of_backend);
        let share = share(error, bound);
        comparison.worst_error = comparison.worst_error.max(error);
        comparison.worst_share = comparison.worst_share.max(share);
        if share <= 1.0 {
            comparison.agreeing += 1;
        } else {
            self.fail(format!("{name} is {of_backend:?}, not {of_reference:?}: off by {error:.3e}, bound {bound:.3e}"));
        }
    }
}

fn share(error: f64, bound: f64) -> f64 {
    if error == 0.0 { 0.0 } else { error / bound }
}

/// A value, or that there is none.
fn shown<T: fmt::Debug>(value: &Option<T>) -> String {
    value.as_ref().map_or("absent".to_owned(), |value| format!("{value:?}"))
}

fn name(output: Outputs) -> String {
    output.names().next().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::percept::{Component, Components, Precision, Values};

    const NAMES: [&str; 1] = ["field"];

    const OF_PRESSURE: Outputs = Outputs::all().difference(Outputs::OF_OTHER_LETTERS);

    /// One field in one frame, in double precision, changed by `change`.
    fn percepts(change: impl Fn(&mut Percepts, &mut Components<f64>)) -> Percepts {
        let mut percepts = Percepts::new(OF_PRESSURE, 1, Precision::F64);
        percepts.reset(1);
        percepts.set_present(0, OF_PRESSURE);
        percepts.active[0] = 3;
        let Values::F64(mut columns) = percepts.values.clone() else { unreachable!("made so") };
        (columns[Component::Total][0], columns[Component::Peak][0], columns[Component::Area][0]) = (10.0, 5.0, 1.0);
        (columns[Component::CentroidU][0], columns[Component::CentroidV][0]) = (0.1, 0.2);
        (columns[Component::Orientation][0], columns[Component::PrincipalAxis][0], columns[Component::Anisotropy][0]) =
            (0.001, 1.0, 0.5);
        columns[Component::Direction][0] = 3.139;
        change(&mut percepts, &mut columns);
        percepts.values = Values::F64(columns);
        percepts
    }

    fn bound() -> CellBound {
        let mut bound = CellBound { centroid: Limit::Within([0.01; 2]), ..CellBound::default() };
        bound.set(OF_PRESSURE.iter().map(|output| (output, Limit::Within(0.01))));
        bound.set([(Outputs::ACTIVE, Limit::Within(0.0))]);
        bound
    }

    fn against(bound: CellBound, change: impl Fn(&mut Percepts, &mut Components<f64>)) -> Agreement {
        compare(&percepts(|_, _| {}), &[bound], &percepts(change), &NAMES)
    }

    #[test]
    fn the_same_agrees_and_so_does_what_is_within_bounds() {
        assert!(against(bound(), |_, _| {}).holds());
        assert!(against(bound(), |_, c| c[Component::Total][0] += 0.009).holds());
        // Either side of the seam is near.
        assert!(against(bound(), |_, c| c[Component::Orientation][0] = std::f64::consts::PI - 0.001).holds());
        assert!(against(bound(), |_, c| c[Component::Direction][0] = -3.139).holds());
    }

    #[test]
    fn a_centroid_is_off_by_the_distance() {
        let agreement =
            against(bound(), |_, c| (c[Component::CentroidU][0], c[Component::CentroidV][0]) = (0.103, 0.196));
        let centroid = agreement.quantities["centroid"];
        assert!(
            (centroid.worst_error - 0.005).abs() < 1e-9 && (centroid.worst_share - 0.4).abs() < 1e-6,
            "{centroid:?}"
        );
    }

    // A test of the engine's comparison checks that each quantity keeps its bound, and each choice is the reference's.
    #[test]
    fn what_is_absent_or_no_number_fails() {
        type Change = fn(&mut Percepts, &mut Components<f64>);
        let changes: [(&str, Change); 6] = [
            ("area", |_, c| c[Component::Area][0] = f64::NAN),
            ("speed", |_, c| c[Component::Speed][0] = f64::INFINITY),
            ("filtered_speed", |p, _| p.remove_present(0, Outputs::FILTERED_SPEED)),
            ("direction", |p, _| p.remove_present(0, Outputs::DIRECTION)),
            ("principal_axis", |p, _| p.remove_present(0, Outputs::PRINCIPAL_AXIS)),
            ("flags", |p, _| p.flags[0] |= Flags::TIE),
        ];
        for (name, change) in changes {
            let agreement = against(bound(), change);
            assert!(!agreement.holds() && agreement.failures[0].contains(name), "{name}: {agreement}");
        }
    }

    #[test]
    fn what_is_too_close_to_call_is_counted_and_not_compared() {
        let mut loose = CellBound { in_doubt: Flags::TIE, ..bound() };
        loose.set([(Outputs::ORIENTATION, Limit::TooClose)]);
        let agreement = against(loose, |p, c| {
            c[Component::Orientation][0] = 1.5;
            p.flags[0] |= Flags::TIE;
        });
        assert!(agreement.holds());
        assert_eq!((agreement.quantities["flags"].too_close, agreement.quantities["orientation"].too_close), (1, 1));
        let other_flag = against(loose, |p, _| p.flags[0] |= Flags::COINCIDENT);
        assert!(!other_flag.holds() && other_flag.quantities["flags"].compared == 1);
    }

    #[test]
    fn every_value_is_counted_once() {
        for limit in [Limit::Within(0.01), Limit::TooClose, Limit::Unread] {
            // One side has it, the other, both, neither.
            for (right, got) in [(true, true), (true, false), (false, true), (false, false)] {
                let with = |has: bool| {
                    percepts(|p, _| {
                        if !has {
                            p.remove_present(0, Outputs::SPEED);
                        }
                    })
                };
                let mut bound = bound();
                bound.set([(Outputs::SPEED, limit)]);
                let agreement = compare(&with(right), &[bound], &with(got), &NAMES);
                let speed = agreement.quantities.get("speed").copied().unwrap_or_default();
                assert_eq!(speed.values(), u64::from(right || got));
                assert_eq!(agreement.holds(), right == got || limit != Limit::Within(0.01), "{agreement}");
                assert_eq!(speed.compared - speed.agreeing, u64::from(!agreement.holds()));
            }
        }
    }

    #[test]
    fn the_verdict_says_which_quantities_have_one_code_on_every_backend() {
        let counts = Comparison { compared: 3, agreeing: 3, ..Comparison::default() };
        let quantities = ["shear", "nearest", "warmest_taxel", "total", "touches.shear"];
        let agreement =
            Agreement { quantities: quantities.map(|name| (name.to_owned(), counts)).into(), ..Agreement::default() };
        let text = agreement.to_string();
        let alike: Vec<&str> = text.lines().filter(|line| line.ends_with("the same code on every backend")).collect();
        let names: Vec<&str> = alike.iter().filter_map(|line| line.split_whitespace().next()).collect();
        assert_eq!(names, ["nearest", "shear", "warmest_taxel"], "{text}");
    }

    #[test]
    fn the_verdict_says_in_its_first_line_what_could_not_be_compared() {
        let first = |bound: CellBound, change: fn(&mut Percepts, &mut Components<f64>)| {
            against(bound, change).to_string().lines().next().unwrap().to_owned()
        };
        assert_eq!(
            first(bound(), |_, _| {}),
            "agrees with the reference: of 26 values in 1 percept, 26 agreeing, 0 different, 0 too close to call, \
             0 not compared"
        );
        let mut loose = bound();
        loose.set([(Outputs::PRINCIPAL_AXIS, Limit::TooClose), (Outputs::SPEED, Limit::Unread)]);
        assert_eq!(
            first(loose, |_, c| c[Component::Speed][0] = 9.0),
            "agrees with the reference: of 26 values in 1 percept, 24 agreeing, 0 different, 1 too close to call, \
             1 not compared, as motion depends on an earlier centroid that was too close to call"
        );
        assert!(first(loose, |_, c| c[Component::Total][0] = 9.0).starts_with(
            "DISAGREES with the reference: of 26 values in 1 percept, 23 agreeing, 1 different, 1 too close to call, 1 not"
        ));
        let nothing = Agreement::default().to_string();
        assert!(
            nothing.starts_with("could not be compared with the reference: of 0 values in 0 percepts"),
            "{nothing}"
        );
    }
}
