//! Holding a single-precision backend to the reference, cell by cell, by derived bounds.

use std::collections::BTreeMap;
use std::fmt;

use glam::DVec2;

use super::reference::CellBound;
use crate::percept::{Flags, Outputs, Percept, Percepts, Touch};
use crate::stage::angle::{between_directions, between_lines};

/// How a backend's percepts compare with the reference's on the same input.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Agreement {
    /// Cells (a field in a frame) looked at.
    pub cells: u64,
    /// Per quantity, what came of comparing it.
    pub quantities: BTreeMap<String, Comparison>,
    /// Cells in which a flag or a quantity's presence was not compared, as the reference's own margin to that decision is
    /// below the bound.
    pub undecided_flags: u64,
    /// Cells that break a bound, differ in a certain flag, or lack a quantity.
    pub failed: u64,
    /// The first of those, in words.
    pub failures: Vec<String>,
}

/// What came of comparing one quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Comparison {
    /// Values compared.
    pub compared: u64,
    /// Values not compared, as the reference's own margin to a choice they hang on is below the bound.
    pub undecided: u64,
    /// Largest error, in the quantity's unit.
    pub worst_error: f64,
    /// Largest share of its bound that an error took: over 1 is a failure.
    pub worst_share: f64,
}

impl Agreement {
    /// Whether nothing failed.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.failed == 0
    }

    /// Adds what another batch gave.
    pub fn merge(&mut self, other: Self) {
        self.cells += other.cells;
        self.undecided_flags += other.undecided_flags;
        self.failed += other.failed;
        self.failures.extend(other.failures);
        self.failures.truncate(MOST_WORDS);
        for (name, more) in other.quantities {
            let sum = self.quantities.entry(name).or_default();
            sum.compared += more.compared;
            sum.undecided += more.undecided;
            sum.worst_error = sum.worst_error.max(more.worst_error);
            sum.worst_share = sum.worst_share.max(more.worst_share);
        }
    }
}

impl fmt::Display for Agreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.holds() { "agrees" } else { "DISAGREES" };
        write!(f, "{verdict} with the reference in {} of {} percepts", self.cells - self.failed, self.cells)?;
        for (name, c) in &self.quantities {
            write!(f, "\n  {name:<21} worst error {:.1e}, {:.0} % of its bound", c.worst_error, 100.0 * c.worst_share)?;
            write!(f, "; {} compared, {} too close to call", c.compared, c.undecided)?;
        }
        write!(f, "\n  {} percepts with a flag too close to call", self.undecided_flags)?;
        for failure in &self.failures {
            write!(f, "\n  {failure}")?;
        }
        Ok(())
    }
}

/// Failures that are put in words; the rest is counted.
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
            let mut cell = Cell { agreement: &mut agreement, failure: None };
            cell.compare(&reference.get(frame, field), bound, &candidate.get(frame, field));
            cell.compare_touches(reference.touches(frame, field), bound, candidate.touches(frame, field));
            let failure = cell.failure;
            agreement.cells += 1;
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

struct Cell<'a> {
    agreement: &'a mut Agreement,
    failure: Option<String>,
}

impl Cell<'_> {
    fn fail(&mut self, what: String) {
        self.failure.get_or_insert(what);
    }

    fn compare(&mut self, right: &Percept, bound: &CellBound, got: &Percept) {
        if !bound.in_doubt.is_empty() {
            self.agreement.undecided_flags += 1;
        }
        let certain = !bound.in_doubt;
        if (right.flags ^ got.flags).intersects(certain) {
            let names = |flags: Flags| (flags & certain).names().collect::<Vec<_>>().join(" ");
            self.fail(format!("flags [{}], but the reference has [{}]", names(got.flags), names(right.flags)));
        }
        // When the input itself lies on a threshold, another set of taxels may be pressed, and nothing is comparable.
        if bound.in_doubt == Flags::all() {
            return;
        }
        if right.active != got.active {
            self.fail(format!("active is {:?}, not {:?}", got.active, right.active));
        }
        let distance = |a: &f64, b: &f64| (a - b).abs();
        self.quantity(Outputs::TOTAL, right.total, got.total, bound.total, distance);
        self.quantity(Outputs::PEAK, right.peak, got.peak, bound.peak, distance);
        self.quantity(Outputs::AREA, right.area, got.area, bound.area, distance);
        for axis in 0..2 {
            let part = |centroid: Option<[f64; 2]>| centroid.map(|c| c[axis]);
            let bound = bound.centroid.map(|c| c[axis]);
            self.quantity(Outputs::CENTROID, part(right.centroid), part(got.centroid), bound, distance);
        }
        self.centroid_is_apart(right, bound, got);
        let apart = |a: &[f64; 3], b: &[f64; 3]| glam::DVec3::from_array(*a).distance(glam::DVec3::from_array(*b));
        // Poses and far origins add the rounding of f64, on both sides.
        let far = right.position.map_or(0.0, |p| 4e-15 * glam::DVec3::from_array(p).length());
        self.quantity(Outputs::POSITION, right.position, got.position, bound.position.map(|b| b + far), apart);
        self.quantity(Outputs::NORMAL, right.normal, got.normal, bound.normal, apart);
        let between = |a: &f64, b: &f64| between_lines(*a, *b);
        self.quantity(Outputs::ORIENTATION, right.orientation, got.orientation, bound.orientation, between);
        self.quantity(Outputs::ANISOTROPY, right.anisotropy, got.anisotropy, bound.anisotropy, distance);
        self.quantity(Outputs::AXIS, right.axis, got.axis, bound.axis, between);
        let apart = |a: &[f64; 2], b: &[f64; 2]| DVec2::from_array(*a).distance(DVec2::from_array(*b));
        self.quantity(Outputs::DISPLACEMENT, right.displacement, got.displacement, bound.displacement, apart);
        let between = |a: &f64, b: &f64| between_directions(*a, *b);
        self.quantity(Outputs::DIRECTION, right.direction, got.direction, bound.direction, between);
        self.quantity(Outputs::DISTANCE, right.distance, got.distance, bound.distance, distance);
        let (limit, right_radial, got_radial) = (bound.radial_distance, right.radial_distance, got.radial_distance);
        self.quantity(Outputs::RADIAL_DISTANCE, right_radial, got_radial, limit, distance);
        self.quantity(Outputs::SPEED, right.speed, got.speed, bound.speed, distance);
        self.quantity(Outputs::RADIAL_SPEED, right.radial_speed, got.radial_speed, bound.radial_speed, distance);
        let (right_step, got_step) = (right.filtered_displacement, got.filtered_displacement);
        self.quantity(Outputs::FILTERED_DISPLACEMENT, right_step, got_step, bound.filtered_displacement, apart);
        let (right_way, got_way) = (right.filtered_direction, got.filtered_direction);
        self.quantity(Outputs::FILTERED_DIRECTION, right_way, got_way, bound.filtered_direction, between);
        let (right_speed, got_speed) = (right.filtered_speed, got.filtered_speed);
        self.quantity(Outputs::FILTERED_SPEED, right_speed, got_speed, bound.filtered_speed, distance);
    }

    /// Coordinates are held to a bound each; what a centroid is off by is the distance, up to √2 times as much.
    fn centroid_is_apart(&mut self, right: &Percept, bound: &CellBound, got: &Percept) {
        if let (Some(right), Some(got), Some(_)) = (right.centroid, got.centroid, bound.centroid) {
            let distance_m = DVec2::from_array(right).distance(DVec2::from_array(got));
            let comparison = self.agreement.quantities.entry("centroid".to_owned()).or_default();
            comparison.worst_error = comparison.worst_error.max(distance_m);
        }
    }

    fn compare_touches(&mut self, right: &[Touch], bound: &CellBound, got: &[Touch]) {
        let Some(limit) = bound.touch else { return };
        if right.len() != got.len() {
            self.fail(format!("touches are {}, not {}", got.len(), right.len()));
            return;
        }
        for (right, got) in right.iter().zip(got) {
            if (right.id, right.active) != (got.id, got.active) {
                self.fail(format!(
                    "touch {} of {} taxels is touch {} of {}",
                    right.id, right.active, got.id, got.active
                ));
            }
            let distance = |a: &f64, b: &f64| (a - b).abs();
            let total = Some(limit.total * right.total);
            self.quantity(Outputs::TOUCHES, Some(right.total), Some(got.total), total, distance);
            let part = |touch: &Touch, axis: usize| touch.centroid.map(|c| c[axis]);
            for axis in 0..2 {
                self.quantity(Outputs::TOUCHES, part(right, axis), part(got, axis), Some(limit.place), distance);
            }
        }
    }

    fn quantity<T: fmt::Debug>(
        &mut self,
        output: Outputs,
        right: Option<T>,
        got: Option<T>,
        bound: Option<f64>,
        distance: impl Fn(&T, &T) -> f64,
    ) {
        let name = output.names().next().unwrap_or_default();
        let (right, got) = match (right, got) {
            (None, None) => return,
            (Some(right), Some(got)) => (right, got),
            (right, got) => {
                // Present in one of them: fine only where the flag that explains it may differ.
                if bound.is_some() {
                    self.fail(format!("{name} is {got:?}, not {right:?}"));
                } else {
                    self.agreement.quantities.entry(name).or_default().undecided += 1;
                }
                return;
            }
        };
        let error = distance(&right, &got);
        let comparison = self.agreement.quantities.entry(name.clone()).or_default();
        let Some(bound) = bound else {
            comparison.undecided += 1;
            return;
        };
        comparison.compared += 1;
        let share = if error == 0.0 { 0.0 } else { error / bound };
        comparison.worst_error = comparison.worst_error.max(error);
        comparison.worst_share = comparison.worst_share.max(share);
        if share.is_nan() || share > 1.0 {
            self.fail(format!("{name} is {got:?}, not {right:?}: off by {error:.3e}, bound {bound:.3e}"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::percept::{Precision, Values};
    use crate::stage::touches::TouchBound;

    const NAMES: [&str; 1] = ["field"];

    /// One field in one frame, in double precision, changed by `change`.
    fn percepts(change: impl Fn(&mut Percepts, &mut crate::percept::Columns<f64>)) -> Percepts {
        let mut percepts = Percepts::new(Outputs::all(), 1, Precision::F64);
        percepts.reset(1);
        percepts.present[0] = Outputs::all();
        percepts.active[0] = 3;
        let Values::F64(mut columns) = percepts.values.clone() else { unreachable!("made so") };
        (columns.total[0], columns.peak[0], columns.area[0]) = (10.0, 5.0, 1.0);
        columns.set_centroid(0, [0.1, 0.2, 0.0]);
        (columns.orientation[0], columns.axis[0], columns.anisotropy[0]) = (0.001, 1.0, 0.5);
        columns.direction[0] = 3.139;
        change(&mut percepts, &mut columns);
        percepts.values = Values::F64(columns);
        percepts
    }

    fn bound() -> CellBound {
        let near = Some(0.01);
        CellBound {
            in_doubt: Flags::empty(),
            total: near,
            peak: near,
            area: near,
            centroid: Some([0.01; 2]),
            position: near,
            normal: near,
            orientation: near,
            axis: near,
            anisotropy: near,
            displacement: near,
            direction: near,
            distance: near,
            radial_distance: near,
            speed: near,
            radial_speed: near,
            touch: None,
            filtered_displacement: near,
            filtered_direction: near,
            filtered_speed: near,
        }
    }

    fn against(bound: CellBound, change: impl Fn(&mut Percepts, &mut crate::percept::Columns<f64>)) -> Agreement {
        compare(&percepts(|_, _| {}), &[bound], &percepts(change), &NAMES)
    }

    #[test]
    fn the_same_agrees_and_so_does_what_is_within_bounds() {
        assert!(against(bound(), |_, _| {}).holds());
        assert!(against(bound(), |_, c| c.total[0] += 0.009).holds());
        // Either side of the seam is near.
        assert!(against(bound(), |_, c| c.orientation[0] = std::f64::consts::PI - 0.001).holds());
        assert!(against(bound(), |_, c| c.direction[0] = -3.139).holds());
    }

    #[test]
    fn a_centroid_is_off_by_the_distance() {
        let agreement = against(bound(), |_, c| (c.centroid_u[0], c.centroid_v[0]) = (0.103, 0.196));
        let centroid = agreement.quantities["centroid"];
        assert!(
            (centroid.worst_error - 0.005).abs() < 1e-9 && (centroid.worst_share - 0.4).abs() < 1e-6,
            "{centroid:?}"
        );
    }

    #[test]
    fn every_quantity_beyond_its_bound_fails() {
        type Change = fn(&mut Percepts, &mut crate::percept::Columns<f64>);
        let changes: [(&str, Change); 24] = [
            ("total", |_, c| c.total[0] += 0.011),
            ("peak", |_, c| c.peak[0] -= 0.011),
            ("area", |_, c| c.area[0] = f64::NAN),
            ("centroid", |_, c| c.centroid_u[0] += 0.011),
            ("centroid", |_, c| c.centroid_v[0] -= 0.011),
            ("position", |p, _| p.position[0][2] += 0.011),
            ("normal", |p, _| p.normal[0][0] += 0.011),
            ("orientation", |_, c| c.orientation[0] += 0.011),
            ("axis", |_, c| c.axis[0] += 1.5),
            ("anisotropy", |_, c| c.anisotropy[0] = 0.6),
            ("displacement", |_, c| c.displacement[0] = [0.008, 0.008]),
            ("direction", |_, c| c.direction[0] = -3.12),
            ("distance", |_, c| c.distance[0] = 0.011),
            ("radial_distance", |_, c| c.radial_distance[0] = -0.011),
            ("speed", |_, c| c.speed[0] = f64::INFINITY),
            ("radial_speed", |_, c| c.radial_speed[0] = 0.011),
            ("filtered_displacement", |p, _| p.filtered_displacement[0] = [0.008, -0.008]),
            ("filtered_direction", |p, _| p.filtered_direction[0] = -0.011),
            ("filtered_speed", |p, _| p.filtered_speed[0] = 0.011),
            ("filtered_speed", |p, _| p.present[0] -= Outputs::FILTERED_SPEED),
            ("direction", |p, _| p.present[0] -= Outputs::DIRECTION),
            ("active", |p, _| p.active[0] = 2),
            ("flags", |p, _| p.flags[0] |= Flags::TIE),
            ("axis", |p, _| p.present[0] -= Outputs::AXIS),
        ];
        for (name, change) in changes {
            let agreement = against(bound(), change);
            assert!(!agreement.holds(), "{name}");
            assert!(agreement.failures[0].contains(name), "{name}: {}", agreement.failures[0]);
        }
    }

    #[test]
    fn a_touch_that_differs_fails() {
        let touch = Touch { id: 1, total: 10.0, active: 3, centroid: Some([0.1, 0.2]), position: [0.0; 3] };
        let touched = |touches: &[Touch]| percepts(|p, _| p.push_touches(touches.iter().copied()));
        let right = touched(&[touch]);
        let limit = CellBound { touch: Some(TouchBound { total: 1e-6, place: 1e-6 }), ..bound() };
        assert!(compare(&right, &[limit], &touched(&[touch]), &NAMES).holds());
        let moved = |by: f64| Touch { centroid: Some([0.1, 0.2 + by]), ..touch };
        assert!(compare(&right, &[limit], &touched(&[moved(0.9e-6)]), &NAMES).holds());
        let others =
            [moved(1.1e-6), Touch { id: 2, ..touch }, Touch { active: 2, ..touch }, Touch { total: 10.1, ..touch }];
        for other in others {
            assert!(!compare(&right, &[limit], &touched(&[other]), &NAMES).holds(), "{other:?}");
        }
        assert!(!compare(&right, &[limit], &touched(&[touch, touch]), &NAMES).holds());
    }

    #[test]
    fn what_is_too_close_to_call_is_counted_and_not_compared() {
        let loose = CellBound { orientation: None, in_doubt: Flags::TIE, ..bound() };
        let agreement = against(loose, |p, c| {
            c.orientation[0] = 1.5;
            p.flags[0] |= Flags::TIE;
        });
        assert!(agreement.holds());
        assert_eq!((agreement.undecided_flags, agreement.quantities["orientation"].undecided), (1, 1));
        let other_flag = against(loose, |p, _| p.flags[0] |= Flags::COINCIDENT);
        assert!(!other_flag.holds());
    }
}
