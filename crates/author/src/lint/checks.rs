//! The checks of a layout, one per function.

use glam::DVec3;

use super::super::surface_search::SurfaceSearch;
use super::drawn_poses::DrawnPoses;
use super::finding::{Finding, FindingKind, count, place};
use super::hidden_findings;
use super::large::large;
use super::spacing;
use crate::body::{Body, ChartKind, FieldSpec, Taxel, listed};
use crate::field::{Field, Unroller};

/// Minimum number of taxels of a field for orientation and axis.
const MIN_FIELD_TAXELS: usize = 3;

/// Maximum angle of a current normal from the surface's, rad.
const NORMAL_TOLERANCE_RAD: f64 = 1e-5;

/// Maximum error of a current (u, v), m, and as a share of its distance from the origin: four roundings to single precision.
const UV_TOLERANCE_M: f64 = 1e-6;
const UV_TOLERANCE_SHARE: f64 = 1e-5;

/// Progress when taxels are compared with the surface, and when charts are.
const SURFACE_DONE: f64 = 0.1;
const CHARTS_DONE: f64 = 0.4;

/// All problems of the layout of `body`, whose fields are `fields`.
///
/// A taxel is compared with the body's surface at rest, a skinned one with the mesh at bind. It is on the surface within
/// 1 µm, beside rounding to single precision; its normal is current within 10⁻⁵ rad of a triangle's there.
///
/// Taxels that nothing can touch are looked for in the poses of the joints that the body keeps, if it keeps any.
#[must_use]
pub fn lint(body: &Body, fields: &[Field]) -> Vec<Finding> {
    lint_in_poses(body, fields, DrawnPoses::of_own_joints(body).as_ref())
}

/// As [`lint`]; taxels that nothing can touch are looked for in `poses`, at rest alone without them.
#[must_use]
pub fn lint_in_poses(body: &Body, fields: &[Field], poses: Option<&DrawnPoses>) -> Vec<Finding> {
    lint_with_progress(body, fields, poses, &mut |_| {})
}

/// As [`lint_in_poses`]; `progress` gets the share that is done.
#[must_use]
pub fn lint_with_progress(
    body: &Body,
    fields: &[Field],
    poses: Option<&DrawnPoses>,
    progress: &mut dyn FnMut(f64),
) -> Vec<Finding> {
    let mut findings = Vec::new();
    findings.extend(empty(body));
    findings.extend(small(fields));
    findings.extend(unused(body, fields));
    findings.extend(spacing::findings(body));
    findings.extend(against_surface(body));
    progress(SURFACE_DONE);
    let mut of_charts = |share: f64| progress(SURFACE_DONE + (CHARTS_DONE - SURFACE_DONE) * share);
    findings.extend(stale_charts(body, &mut of_charts));
    findings.extend(large(body));
    let mut of_rays = |share: f64| progress(CHARTS_DONE + (1.0 - CHARTS_DONE) * share);
    findings.extend(hidden_findings::hidden(body, poses, &mut of_rays));
    findings
}

fn empty(body: &Body) -> Vec<Finding> {
    let mut findings = Vec::new();
    if body.taxels.is_empty() {
        let what = "the body has no taxels and cannot be run";
        findings.push(Finding::of_taxels(FindingKind::NoTaxels, Vec::new(), what.to_owned()));
    }
    if body.fields.is_empty() {
        let what = "the body has no fields and cannot be run";
        findings.push(Finding::of_fields(FindingKind::NoFields, Vec::new(), what.to_owned()));
    }
    findings
}

fn small(fields: &[Field]) -> Option<Finding> {
    let small: Vec<&Field> = fields.iter().filter(|field| field.members.len() < MIN_FIELD_TAXELS).collect();
    let least = small.iter().min_by_key(|field| field.members.len())?;
    let names: Vec<String> = small.iter().map(|field| field.name.clone()).collect();
    let fields = count(names.len(), "field");
    let what = format!("{fields} with under {MIN_FIELD_TAXELS} taxels, too few for orientation: {}", listed(&names));
    let place = Some(format!("field `{}`", least.name));
    let worst = Some(least.members.len() as f64);
    Some(Finding { worst, place, ..Finding::of_fields(FindingKind::SmallField, names, what) })
}

fn unused(body: &Body, fields: &[Field]) -> Option<Finding> {
    if fields.is_empty() {
        return None;
    }
    let mut held = vec![false; body.taxels.len()];
    fields.iter().flat_map(|field| &field.members).for_each(|member| held[member.taxel] = true);
    let loose: Vec<u32> = body.taxels.iter().zip(held).filter(|(_, held)| !held).map(|(taxel, _)| taxel.id).collect();
    if loose.is_empty() {
        return None;
    }
    let taxels = count(loose.len(), "taxel");
    let what = format!("{taxels} in no field, so touches there are not reported: {}", listed(&loose));
    Some(Finding::of_taxels(FindingKind::UnusedTaxel, loose, what))
}

/// Distance and angle of a taxel to the surface below it.
pub(in super::super) struct SurfaceFit {
    pub(in super::super) off_m: f64,
    /// Angle of its normal with the nearest triangle normal there, rad.
    pub(in super::super) tilt_rad: f64,
    pub(in super::super) normal_in_link: DVec3,
}

impl SurfaceFit {
    pub(in super::super) fn for_taxel(body: &Body, surface_search: &SurfaceSearch<'_>, taxel: &Taxel) -> Option<Self> {
        let body_from_link = body.links[taxel.link].body_from_link;
        let p = body_from_link.transform_point3(taxel.position_in_link);
        let normal = body_from_link.transform_vector3(taxel.normal_in_link);
        let hit = surface_search.nearest(taxel.link, p)?;
        // On an edge the normals of both triangles count.
        let around =
            surface_search.normals_at(taxel.link, hit.position).map(|normal_there| angle(normal, normal_there));
        let tilt_rad = around.fold(angle(normal, hit.normal), f64::min);
        let normal_in_link = body_from_link.inverse().transform_vector3(hit.normal);
        Some(Self { off_m: hit.position.distance(p), tilt_rad, normal_in_link })
    }

    /// Whether the normal differs from the surface's.
    pub(in super::super) fn is_stale(&self) -> bool {
        self.tilt_rad > NORMAL_TOLERANCE_RAD
    }
}

/// The angle between two unit vectors, accurate for small angles.
fn angle(a: DVec3, b: DVec3) -> f64 {
    libm::atan2(a.cross(b).length(), a.dot(b))
}

/// Taxels off the surface, with normals that point inward, and with normals that are not the surface's.
fn against_surface(body: &Body) -> Vec<Finding> {
    let surface_search = SurfaceSearch::from_body(body);
    if surface_search.is_empty() {
        return Vec::new();
    }
    let (mut off, mut inward, mut stale) = (Worst::default(), Worst::default(), Worst::default());
    for taxel in &body.taxels {
        let Some(fit) = SurfaceFit::for_taxel(body, &surface_search, taxel) else { continue };
        if fit.off_m > surface_search.tolerance_m() {
            off.take(taxel, fit.off_m);
        }
        if fit.tilt_rad > std::f64::consts::FRAC_PI_2 {
            inward.take(taxel, fit.tilt_rad);
        } else if fit.is_stale() {
            stale.take(taxel, fit.tilt_rad);
        }
    }
    let degrees = |angle: f64| format!("{:.3}°", angle.to_degrees());
    let length = |distance: f64| format!("{:.3} mm", distance * 1e3);
    [
        off.finding(body, FindingKind::OffSurface, "off the surface", &length),
        inward.finding(body, FindingKind::InwardNormal, "with a normal that points into the body", &degrees),
        stale.finding(body, FindingKind::StaleNormal, "with a normal that is not the surface's", &degrees),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Taxels with the same problem, and the worst of them.
#[derive(Default)]
struct Worst<'a> {
    ids: Vec<u32>,
    worst: Option<(f64, &'a Taxel)>,
}

impl<'a> Worst<'a> {
    fn take(&mut self, taxel: &'a Taxel, number: f64) {
        self.ids.push(taxel.id);
        if self.worst.is_none_or(|(most, _)| number > most) {
            self.worst = Some((number, taxel));
        }
    }

    fn finding(self, body: &Body, kind: FindingKind, what: &str, shown: &dyn Fn(f64) -> String) -> Option<Finding> {
        let (worst, taxel) = self.worst?;
        let place = place(body, taxel);
        let taxels = count(self.ids.len(), "taxel");
        let what = format!("{taxels} {what}: {}; most {place}, {}", listed(&self.ids), shown(worst));
        Some(Finding { worst: Some(worst), place: Some(place), ..Finding::of_taxels(kind, self.ids, what) })
    }
}

/// Fields whose stored (u, v) differ from a newly computed chart, or that cannot have one any more.
fn stale_charts(body: &Body, progress: &mut dyn FnMut(f64)) -> Option<Finding> {
    let mut unroller = Unroller::new(body);
    let mut stale: Vec<String> = Vec::new();
    let mut worst: Option<(f64, String)> = None;
    for (index, spec) in body.fields.iter().enumerate().filter(|(_, spec)| may_be_stale(body, spec)) {
        progress(index as f64 / body.fields.len() as f64);
        match drift(&mut unroller, spec) {
            Some(0.0) => continue,
            Some(most) if worst.as_ref().is_none_or(|(known, _)| most > *known) => {
                worst = Some((most, format!("field `{}`", spec.name)));
            }
            _ => {}
        }
        stale.push(spec.name.clone());
    }
    if stale.is_empty() {
        return None;
    }
    let by = worst.as_ref().map(|(most, place)| format!("; most {place}, {:.3} mm", most * 1e3)).unwrap_or_default();
    let fields = count(stale.len(), "field");
    let what = format!("{fields} with a stored chart that differs from a new one: {}{by}", listed(&stale));
    let (worst, place) = worst.unzip();
    Some(Finding { worst, place, ..Finding::of_fields(FindingKind::StaleChart, stale, what) })
}

/// Whether the layout of `body` stores a chart of `spec` that can be computed anew.
pub(in super::super) fn may_be_stale(body: &Body, spec: &FieldSpec) -> bool {
    spec.chart.is_some_and(|chart| match chart.kind {
        ChartKind::Geodesic => !body.surfaces.is_empty(),
        ChartKind::Normals => true,
        ChartKind::Plane | ChartKind::None => false,
    })
}

/// The error of the stored (u, v) of `spec`, m; 0 if all are current, `None` if some are
/// missing or the chart cannot be computed.
pub(in super::super) fn drift(unroller: &mut Unroller<'_>, spec: &FieldSpec) -> Option<f64> {
    // A parent without taxels of its own has no (u, v).
    if spec.members.is_empty() {
        return Some(0.0);
    }
    let anew = unroller.unroll(spec).ok()?;
    let mut most = 0.0;
    for (stored, current) in spec.members.values().zip(anew.members.values()) {
        let ([u, v], [x, y]) = (stored.uv?, current.uv?);
        let (off, distance) = (libm::hypot(u - x, v - y), libm::hypot(x, y));
        if off > UV_TOLERANCE_M + UV_TOLERANCE_SHARE * distance {
            most = f64::max(most, off);
        }
    }
    Some(most)
}
