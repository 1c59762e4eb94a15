//! `_info`, `_inspect`, `_compare` and `_outputs`: what is in a recording, what bodies hold, and which quantities there are, as JSON.

use std::path::{Path, PathBuf};

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde_json::{Value, json};
use somatic::author::coverage;
use somatic::body::Up;
use somatic::field::FieldSet;
use somatic::internal::author::{DrawnPoses, lint_with_progress};
use somatic::internal::contents::{
    ContactTable, Contacts, Contents, FoundContacts, Quantity, Rule, Threshold, bag_as_json, of_fields, of_touches,
};
use somatic::internal::expected::{TestTouches, compare_layouts, expected_and_ideal_errors};
use somatic::internal::field::{ContactTolerance, TaxelGraph, rest_overlaps};
use somatic::internal::recording::BagSurvey;
use somatic::internal::robot::drawn_poses;
use somatic::internal::setup::{Tell, open_mapped, source_of};
use somatic::output::OutputPaths;
use somatic::recording::Reader;
use somatic::robot::Kinematics;
use somatic::source::{CsvSource, Source, SourceSpec, VendorOptions, VendorSource};
use somatic::{Body, Calibration, Result};

use crate::author::up_of;
use crate::body::PyBody;
use crate::error::{OrRaise, interrupted, usage};
use crate::opening::Keys;
use crate::threads::{free, goes_on};

/// Frames that are read until Ctrl-C is heard.
const FRAMES_BETWEEN: u64 = 1 << 10;

/// What a recording of nothing but frames has, which is read to its end, and what `contacts` sees there; None where Ctrl-C ended it.
fn of_frames(
    kind: &'static str,
    path: &Path,
    source: &mut dyn Source,
    mut contacts: Option<&mut Contacts>,
    raised: &mut Option<PyErr>,
) -> Result<Option<Contents>> {
    let mut frames = 0_u64;
    let known = Contents::of_frames(kind, path, source, |frame, _| {
        if let Some(contacts) = &mut contacts {
            contacts.see(frame)?;
        }
        frames += 1;
        Ok(!frames.is_multiple_of(FRAMES_BETWEEN) || goes_on(raised))
    })?;
    Ok(known)
}

/// The contacts in the MCAP at `path`, if it has its body; what is damaged is a loss of `known`.
fn of_mcap(path: &Path, known: &mut Contents, rule: Rule, raised: &mut Option<PyErr>) -> Result<Option<FoundContacts>> {
    let goes_on = |frames: u64| !frames.is_multiple_of(FRAMES_BETWEEN) || goes_on(raised);
    match Contacts::of_mcap(path, &Tell::default(), rule, goes_on) {
        Err(e) if !e.is_usage() => {
            known.losses.push(e.to_string());
            Ok(None)
        }
        contacts => contacts,
    }
}

/// What is in the recording called `text`, and the rows of a table of its contacts, if it has its body.
fn known(
    text: &str,
    options: &VendorOptions,
    rule: Rule,
    raised: &mut Option<PyErr>,
) -> Result<(Value, Option<String>)> {
    let mapped = options.map.is_some();
    let kinds: &[&str] =
        if mapped { &["ndjson", "mcap", "ros2-mcap"] } else { &["csv", "mcap", "ros2-mcap", "export"] };
    let (known, contacts) = match &source_of(text, kinds, options)? {
        spec @ (SourceSpec::Ros2Mcap(_) | SourceSpec::Ndjson(_)) if mapped => {
            let path = spec.file().unwrap_or(Path::new(""));
            (of_frames("messages", path, &mut open_mapped(spec, options)?, None, raised)?, None)
        }
        SourceSpec::Mcap(path) => {
            let mut known = Contents::of_mcap(path, &mut Reader::open(path)?, |_| {})?;
            let contacts = of_mcap(path, &mut known, rule, raised)?;
            (Some(known), contacts)
        }
        SourceSpec::Ros2Mcap(bag) => {
            let mut survey = BagSurvey::read(&bag.path, |_| {})?;
            survey.topics.retain(|topic| bag.topics.is_empty() || bag.topics.contains(&topic.name));
            return Ok((bag_as_json(&survey), None));
        }
        SourceSpec::Vendor(path) => {
            let mut source = VendorSource::open(path, options)?;
            let (kind, layout) = (source.format().title(), Some(source.layout().clone()));
            let body = Body::from_bytes(&source.body_name(), &source.body()?)?;
            let ids = source.taxels().to_vec();
            let calibration = source.calibration().map(|text| Calibration::parse(&text, &ids)).transpose()?;
            let mut contacts = Contacts::new(&body, calibration, &source)?;
            let known = of_frames(kind, path, &mut source, Some(&mut contacts), raised)?;
            (known.map(|known| Contents { layout, ..known }), Some(contacts.finish(rule)?))
        }
        spec => {
            let path = spec.file().unwrap_or(Path::new(""));
            (of_frames("CSV", path, &mut CsvSource::open(path, options.rate_hz)?, None, raised)?, None)
        }
    };
    let json = known.map_or(Value::Null, |known| {
        let mut json = known.as_json();
        json["fields"] = contacts.as_ref().map_or(Value::Null, |contacts| contacts.as_json().into());
        json
    });
    let table = |contacts: FoundContacts| {
        let mut table = ContactTable::new()?;
        table.add(text, &contacts)?;
        String::from_utf8(table.into_bytes()?).map_err(|e| Error::failed(e.to_string()))
    };
    Ok((json, contacts.map(table).transpose()?))
}

#[pyfunction]
#[pyo3(name = "_info")]
#[expect(clippy::too_many_arguments, reason = "they are keywords")]
pub(crate) fn info(
    py: Python<'_>,
    source: &str,
    rate_hz: Option<f64>,
    format: Option<&str>,
    grid: Option<&str>,
    pitch: Option<&str>,
    unit: Option<&str>,
    layout: Option<PathBuf>,
    map: Option<&str>,
    threshold: Option<&str>,
    shortest_s: Option<f64>,
    contacts: bool,
    table: Option<PathBuf>,
    force: bool,
) -> PyResult<(String, Option<String>)> {
    let read = source.split_once(':').map_or(source, |(_, path)| path);
    let reads = [Some(source.into()), Some(read.into()), layout.clone()];
    let mut outputs = OutputPaths::new(force, reads.into_iter().flatten().collect::<Vec<PathBuf>>());
    let output = table.map(|table| outputs.add(&table)).transpose().or_raise(py)?;
    let keys = Keys { rate_hz, format, grid, pitch, unit, layout, map, ..Keys::default() };
    let options = keys.options().or_raise(py)?;
    let threshold = threshold.map(str::parse::<Threshold>).transpose().or_raise(py)?;
    let rule = Rule { threshold, shortest_s: shortest_s.unwrap_or(Rule::default().shortest_s) };
    let mut raised = None;
    let (known, rows) = free(py, || known(source, &options, rule, &mut raised)).or_raise_of(py, Path::new(source))?;
    if raised.is_some() {
        return Err(interrupted(raised));
    }
    if contacts && rows.is_none() {
        let what = "it has no body, which contacts need; convert it with one: convert(source, \"OUT.mcap\", body=BODY)";
        return Err(usage(py, format!("{source}: {what}")));
    }
    if let (Some(output), Some(rows)) = (output, &rows) {
        let path = output.name().to_owned();
        output.write(rows.as_bytes()).or_raise_of(py, &path)?;
    }
    Ok((known.to_string(), rows.filter(|_| contacts)))
}

#[pyfunction]
#[pyo3(name = "_inspect")]
pub(crate) fn inspect(
    py: Python<'_>,
    body: &PyBody,
    contact_tolerance_m: Option<f64>,
    errors: bool,
    joints: Option<PathBuf>,
    up: Option<&str>,
) -> PyResult<String> {
    if let Some(tolerance) = contact_tolerance_m.filter(|it| !(it.is_finite() && *it > 0.0)) {
        return Err(usage(py, format!("contact_tolerance_m should be over 0; this is {tolerance}")));
    }
    if up.is_some() && joints.is_none() {
        return Err(usage(py, "up: it is for the URDF of joints=; leave it out, or give both"));
    }
    let up = up_of(up).or_raise(py)?;
    let seen = free(py, || -> Result<Value> {
        let body = &*body.inner;
        let poses = match &joints {
            None => DrawnPoses::of_own_joints(body),
            Some(urdf) => {
                let up = up.or_else(|| body.urdf_up()).unwrap_or(Up::Z);
                let drawn = |robot: Kinematics| drawn_poses(&robot, body, up).map_err(|e| e.at(urdf.display()));
                Some(Kinematics::load(urdf).and_then(drawn)?)
            }
        };
        let mut findings = body.findings.clone();
        let fields = FieldSet::new(body).map_or_else(
            |error| {
                findings.push(error.to_string());
                Vec::new()
            },
            |set| set.fields,
        );
        let odd = lint_with_progress(body, &fields, poses.as_ref(), &mut |_| {});
        let (graph, outdated) = TaxelGraph::from_body(body);
        findings.extend(outdated);
        findings.extend(odd.iter().map(ToString::to_string));
        let covered = coverage(body);
        let (area, seen) = covered.of_skin();
        let taxels = |link: usize| body.taxels.iter().filter(|taxel| taxel.link == link).count();
        let links = body.links.iter().enumerate().map(|(index, link)| {
            let surface = covered.links.iter().find(|of| of.link == index);
            json!({
                "name": link.name, "taxels": taxels(index), "area": surface.map(|of| of.area),
                "covered": surface.map(|of| of.seen),
            })
        });
        let fields = fields.iter().map(|field| {
            json!({
                "name": field.name, "taxels": field.members.len(),
                "chart": field.chart.as_ref().ok().map(|chart| format!("{:?}", chart.kind).to_lowercase()),
                "distortion": field.chart.as_ref().ok().map(|chart| chart.distortion),
            })
        });
        let name = |link: usize| body.links[link].name.as_str();
        let overlaps = rest_overlaps(body, &ContactTolerance::new(body, contact_tolerance_m));
        let errors = errors.then(|| expected_and_ideal_errors(body, &TestTouches::default())).transpose()?;
        Ok(json!({
            "body": body.name, "taxels": body.taxels.len(), "links": links.collect::<Vec<_>>(),
            "fields": fields.collect::<Vec<_>>(), "edges": graph.edges().count(),
            "islands": graph.islands(body).iter().filter(|island| island.len() > 1).count(),
            "skin": {"area": area, "covered": seen},
            "holes": covered.holes.iter().map(|hole| {
                json!({"link": name(hole.link), "position": hole.position_in_link.to_array(), "area": hole.area})
            }).collect::<Vec<_>>(),
            "near_at_rest": overlaps.len(), "findings": findings,
            "errors": errors.map(|[layout, ideal]| layout.as_json_with_ideal(&ideal)),
        }))
    });
    Ok(seen.or_raise(py)?.to_string())
}

#[pyfunction]
#[pyo3(name = "_compare")]
pub(crate) fn compare(py: Python<'_>, first: &PyBody, second: &PyBody, touches: usize) -> PyResult<String> {
    let [first, second] = [&*first.inner, &*second.inner];
    if touches == 0 {
        return Err(usage(py, "touches should be 1 or more"));
    }
    let touches = TestTouches::default().count(touches);
    let compared = free(py, || compare_layouts([first, second], &touches)).or_raise(py)?;
    Ok(compared.as_json([&first.name, &second.name], [first, second]).to_string())
}

#[pyfunction]
#[pyo3(name = "_outputs")]
pub(crate) fn outputs() -> PyResult<String> {
    let rows = of_touches().into_iter().chain(of_fields());
    let rows: Vec<Quantity> = rows.map(|row| Quantity { what: row.what.trim(), ..row }).collect();
    serde_json::to_string(&rows).map_err(|why| PyValueError::new_err(why.to_string()))
}
