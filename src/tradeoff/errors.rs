//! Errors of percepts against the reference and against the truth.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::fits::{self, FitOnLink};
use crate::body::Body;
use crate::engine::Options;
use crate::error::Result;
use crate::field::Recharted;
use crate::percept::{Flags, Outputs, Percept, TouchFrame};
use crate::scene::{Charts, OrientationBy, Plan, PlanField, Scene};
use crate::signal::{Calibration, Letter};
use crate::source::Truth;
use crate::stage::angle;

/// Statistics of errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Their number.
    pub compared: u64,
    /// Root of the mean square.
    pub rms: f64,
    /// The middle one.
    pub median: f64,
    /// The 95th percentile.
    pub p95: f64,
    /// The 99th percentile.
    pub p99: f64,
    /// The largest.
    pub worst: f64,
}

impl Errors {
    pub(super) fn from_samples(errors: &mut [f64]) -> Self {
        if errors.is_empty() {
            return Self::default();
        }
        errors.sort_by(f64::total_cmp);
        let squares: f64 = errors.iter().map(|error| error * error).sum();
        Self {
            compared: errors.len() as u64,
            rms: (squares / errors.len() as f64).sqrt(),
            median: rank(errors, 0.5),
            p95: rank(errors, 0.95),
            p99: rank(errors, 0.99),
            worst: errors[errors.len() - 1],
        }
    }
}

/// The percentile `share` of `sorted`.
pub(super) fn rank(sorted: &[f64], share: f64) -> f64 {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted[rank.clamp(1, sorted.len()) - 1]
}

/// Fields with one kind of charts and their surface, to compare points of different charts.
pub(super) struct ChartGeometry {
    plan: Plan,
    /// Fields that could not have such a chart.
    pub(super) kept: Vec<String>,
}

impl ChartGeometry {
    /// For `charted`, which are the body's fields in `charts`.
    pub(super) fn new(body: &Body, options: &Options, charts: Charts, charted: &Recharted) -> Result<Self> {
        let mut scene =
            Scene::default().outputs(Outputs::CENTROID | Outputs::POSITION).letters(vec![Letter::default()]);
        scene.fields.clone_from(&options.scene.fields);
        let plan = Plan::new(body, &charted.fields, &scene, &Calibration::identity(body.taxels.len()))?;
        let kept = charted.kept.iter().map(|(name, why)| format!("{charts}: {name}: {why}")).collect();
        Ok(Self { plan, kept })
    }

    fn field(&self, field: usize) -> &PlanField {
        &self.plan.fields[field]
    }

    pub(super) fn index_of(&self, name: &str) -> Option<usize> {
        self.plan.fields.iter().position(|field| field.name == name)
    }

    pub(super) fn link(&self, field: usize) -> &str {
        &self.field(field).link
    }

    /// The surface point at `uv`, in the field's anchor, m.
    fn point(&self, field: usize, uv: DVec2) -> Option<DVec3> {
        let field = self.field(field);
        let surface = field.surface.as_ref()?;
        Some(surface.at(uv).0)
    }

    /// The direction on the surface of a line at `angle` through `uv`.
    fn direction(&self, field: usize, uv: DVec2, angle: f64) -> Option<DVec3> {
        let step = DVec2::new(libm::cos(angle), libm::sin(angle)) * (self.reach_m(field) / 2.0);
        (self.point(field, uv + step)? - self.point(field, uv - step)?).try_normalize()
    }

    /// Typical distance of taxels, m; directions on the surface are taken over it.
    fn reach_m(&self, field: usize) -> f64 {
        self.field(field).spacing * f64::from(self.field(field).unit_m)
    }

    /// Whether all fields have the same charts in `other`.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        (0..self.plan.fields.len()).all(|field| self.has_same_chart(other, field))
    }

    fn has_same_chart(&self, other: &Self, field: usize) -> bool {
        self.field(field).chart == other.field(field).chart
    }
}

#[derive(Default)]
pub(super) struct ErrorSamples {
    /// mm, and degrees.
    pub(super) centroid: Vec<f64>,
    pub(super) orientation: Vec<f64>,
}

/// Errors against the truth.
#[derive(Default)]
pub(super) struct TrueErrorSamples {
    /// Of the place of what is round, mm.
    round: Vec<f64>,
    /// Of the place of a rod or an edge, across it, mm.
    across: Vec<f64>,
    /// Of its orientation, degrees.
    orientation: Vec<f64>,
    touches: u64,
    given: u64,
}

/// How far what percepts say of simulated touches is from the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TrueErrors {
    /// Number of touches.
    pub touches: u64,
    /// The share of touches with a place. Moments always give one, a fit of contacts only where it explains the sensors.
    pub given: f64,
    /// Errors of all places that are given, mm: of round contacts, and of rods and edges across them.
    pub place_mm: Errors,
    /// Errors of the places of round contacts, mm.
    pub round_mm: Errors,
    /// Errors of the places of rods and edges, across them, mm. Sensors cannot say where along a rod it is pressed.
    pub across_mm: Errors,
    /// Errors of the orientations that are given of rods and edges, degrees.
    pub orientation_deg: Errors,
}

impl TrueErrors {
    pub(super) fn from_samples(samples: &mut TrueErrorSamples) -> Self {
        let mut places = [&samples.round[..], &samples.across].concat();
        Self {
            touches: samples.touches,
            given: if samples.touches > 0 { samples.given as f64 / samples.touches as f64 } else { 0.0 },
            place_mm: Errors::from_samples(&mut places),
            round_mm: Errors::from_samples(&mut samples.round),
            across_mm: Errors::from_samples(&mut samples.across),
            orientation_deg: Errors::from_samples(&mut samples.orientation),
        }
    }
}

/// The orientation of a percept `by` a method of fields.
fn orientation(percept: &Percept, by: OrientationBy) -> Option<f64> {
    match by {
        OrientationBy::AsAsked | OrientationBy::TwoPoints => percept.orientation,
        _ => percept.principal_axis,
    }
}

/// The angle between two lines, degrees.
fn between(a: DVec3, b: DVec3) -> f64 {
    libm::atan2(a.cross(b).length(), a.dot(b).abs()).to_degrees()
}

impl ErrorSamples {
    /// Adds the errors of `got`, in the charts of `geometry`, against `right`, in those of `authored`.
    pub(super) fn add(
        &mut self,
        geometry: &ChartGeometry,
        authored: &ChartGeometry,
        got: &Percept,
        right: &Percept,
        by: OrientationBy,
    ) {
        let field = got.field;
        let places = got.centroid.zip(right.centroid);
        let Some((at, right_at)) = places.map(|(a, b)| (DVec2::from_array(a), DVec2::from_array(b))) else { return };
        let same = geometry.has_same_chart(authored, field);
        let off = if same {
            Some(at.distance(right_at))
        } else {
            geometry.point(field, at).zip(authored.point(field, right_at)).map(|(a, b)| a.distance(b))
        };
        self.centroid.extend(off.map(|metres| metres * 1e3));
        let by_points = matches!(by, OrientationBy::AsAsked | OrientationBy::TwoPoints);
        let tied = by_points && (got.flags | right.flags).contains(Flags::TIE);
        let (Some(a), Some(b)) = (orientation(got, by), orientation(right, by)) else { return };
        let turned = if same {
            Some(angle::between_lines(a, b).to_degrees())
        } else {
            let directions = geometry.direction(field, at, a).zip(authored.direction(field, right_at, b));
            directions.map(|(a, b)| between(a, b))
        };
        self.orientation.extend(turned.filter(|_| !tied));
    }

    /// Adds the errors of the fits of the touches in `got` against those in `right`.
    pub(super) fn add_fits(&mut self, got: &TouchFrame, right: &TouchFrame) {
        for (got, right) in fits::shared(got, right) {
            self.centroid.push(1e3 * got.place.distance(right.place));
            self.orientation.extend(got.direction.zip(right.direction).map(|(a, b)| between(a, b)));
        }
    }
}

impl TrueErrorSamples {
    /// Adds the errors of `got`, `by` a method of fields, against the `truth` of the only touch on its field.
    pub(super) fn add(
        &mut self,
        geometry: &ChartGeometry,
        authored: &ChartGeometry,
        got: &Percept,
        truth: &Truth,
        by: OrientationBy,
    ) {
        let (field, at) = (got.field, got.centroid.map(DVec2::from_array));
        let place = at.and_then(|at| geometry.point(field, at));
        let angle = orientation(got, by).zip(at);
        let direction = angle.and_then(|(angle, at)| geometry.direction(field, at, angle));
        self.add_one(authored, field, at.map(|_| (place, direction)), truth);
    }

    /// Adds the errors of `fit`, on the link of the `truth` of the only touch on `field`, if there is one.
    pub(super) fn add_fit(&mut self, authored: &ChartGeometry, field: usize, fit: Option<FitOnLink>, truth: &Truth) {
        self.add_one(authored, field, fit.map(|fit| (Some(fit.place), fit.direction)), truth);
    }

    /// Adds the errors of a place and a direction on a link, as far as these are known, if they are given.
    fn add_one(
        &mut self,
        authored: &ChartGeometry,
        field: usize,
        given: Option<(Option<DVec3>, Option<DVec3>)>,
        truth: &Truth,
    ) {
        self.touches += 1;
        let Some((place, direction)) = given else { return };
        self.given += 1;
        let right = truth.angle.zip(truth.uv);
        let right = right.and_then(|(angle, uv)| authored.direction(field, DVec2::from_array(uv), angle));
        let off = place.map(|place| place - truth.position_in_link);
        match right {
            Some(along) => self.across.extend(off.map(|off| 1e3 * off.reject_from_normalized(along).length())),
            None => self.round.extend(off.map(|off| 1e3 * off.length())),
        }
        self.orientation.extend(direction.zip(right).map(|(a, b)| between(a, b)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundled;
    use crate::field::FieldSet;

    #[test]
    fn errors_are_counted_and_ranked() {
        let mut errors: Vec<f64> = (1..=200).rev().map(f64::from).collect();
        let percentiles = Errors::from_samples(&mut errors);
        assert_eq!(
            (percentiles.compared, percentiles.median, percentiles.p95, percentiles.p99, percentiles.worst),
            (200, 100.0, 190.0, 198.0, 200.0)
        );
        assert!((percentiles.rms - (200.0 * 201.0 * 401.0 / 6.0 / 200.0_f64).sqrt()).abs() < 1e-9);
        assert_eq!(Errors::from_samples(&mut []), Errors::default());
        assert_eq!(
            Errors::from_samples(&mut [3.0]),
            Errors { compared: 1, rms: 3.0, median: 3.0, p95: 3.0, p99: 3.0, worst: 3.0 }
        );
    }

    #[test]
    fn a_place_is_the_same_on_the_skin_whatever_chart_it_is_reported_in() {
        let body = Body::from_bytes("humanoid", bundled::HUMANOID).unwrap();
        let geometries = [Charts::Plane, Charts::Geodesic].map(|charts| {
            let charted = charts.applied(&body, FieldSet::new(&body).unwrap(), &[]).unwrap();
            ChartGeometry::new(&body, &Options::default(), charts, &charted).unwrap()
        });
        let [plane, geodesic] = &geometries;
        let mut compared = 0;
        for field in 0..plane.plan.fields.len() {
            if plane.has_same_chart(geodesic, field) {
                continue;
            }
            let members = plane.field(field).places.iter().zip(&geodesic.field(field).places);
            let unit = f64::from(plane.field(field).unit_m);
            let other = f64::from(geodesic.field(field).unit_m);
            for (a, b) in members {
                let a = plane.point(field, a.truncate() * unit);
                let b = geodesic.point(field, b.truncate() * other);
                // Some have a chart of one kind only.
                let (Some(a), Some(b)) = (a, b) else { continue };
                // Both are read off a grid over the skin, no finer than a part of the spacing.
                assert!(a.distance(b) < 0.25 * plane.reach_m(field), "{}", plane.field(field).name);
                compared += 1;
            }
        }
        assert!(compared > 50, "{compared}");
    }
}
