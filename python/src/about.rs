//! `_info`, `_inspect` and `_outputs`: what is in a recording, what a body holds, and which quantities there are, as JSON.

use std::path::Path;

use pyo3::prelude::*;
use serde_json::{Value, json};
use somatic::author::coverage;
use somatic::field::FieldSet;
use somatic::internal::author::{DrawnPoses, lint_with_progress};
use somatic::internal::field::{ContactTolerance, TaxelGraph, rest_overlaps};
use somatic::internal::recording::{BagSurvey, Rhythm, Survey};
use somatic::internal::setup::source_of;
use somatic::internal::source::Layout;
use somatic::percept::{COLUMNS, TOUCH_COLUMNS, TouchOutputs};
use somatic::recording::Reader;
use somatic::source::{CsvSource, Source, SourceSpec, VendorOptions, VendorSource};
use somatic::{Frame, Outputs, Result};

use crate::body::PyBody;
use crate::error::{OrRaise, interrupted};
use crate::threads::{free, goes_on};

/// Frames that are read until Ctrl-C is heard.
const FRAMES_BETWEEN: u64 = 1 << 10;

/// What a recording of nothing but frames has, which is read to its end; None where Ctrl-C ended it.
fn of_frames(source: &mut dyn Source, raised: &mut Option<PyErr>) -> Result<Option<Rhythm>> {
    let mut rhythm = Rhythm::default();
    let mut frame = Frame::missing(0.0, source.taxels().len());
    while source.next_frame(&mut frame)? {
        rhythm.see(frame.t_s);
        if rhythm.frames.is_multiple_of(FRAMES_BETWEEN) && !goes_on(raised) {
            return Ok(None);
        }
    }
    rhythm.finish();
    Ok(Some(rhythm))
}

fn size(path: &Path) -> u64 {
    std::fs::metadata(path).map_or(0, |metadata| metadata.len())
}

fn layout_of(layout: &Layout) -> Value {
    let panel = |panel: &somatic::internal::source::Panel| {
        json!({
            "name": panel.name, "taxels": panel.cells.len(), "placed": panel.is_placed,
            "area": panel.cells.iter().map(|cell| cell.area_m2).sum::<f64>(),
        })
    };
    json!(layout.panels.iter().map(panel).collect::<Vec<_>>())
}

/// Its times.
fn times(rhythm: &Rhythm) -> Value {
    json!({
        "frames": rhythm.frames, "start": rhythm.span_s.map(|span| span[0]),
        "duration": rhythm.span_s.map(|[first, last]| last - first), "rate_hz": rhythm.rate_hz(), "gaps": rhythm.gaps,
        "longest_gap": rhythm.longest_gap_s.map(|[seconds, after]| json!({"seconds": seconds, "after": after})),
        "backwards": rhythm.backwards,
    })
}

/// The members of both.
fn joined(mut a: Value, b: Value) -> Value {
    if let (Value::Object(a), Value::Object(b)) = (&mut a, b) {
        a.extend(b);
    }
    a
}

fn known(text: &str, options: &VendorOptions, raised: &mut Option<PyErr>) -> Result<Value> {
    let spec = source_of(text, &["csv", "mcap", "ros2-mcap", "export"], options)?;
    Ok(match &spec {
        SourceSpec::Mcap(path) => {
            let mut reader = Reader::open(path)?;
            let survey = Survey::read(&mut reader, |_| {})?;
            let topic = |t: &somatic::internal::recording::Topic| json!({"topic": t.name, "encoding": t.encoding, "messages": t.messages, "bytes": t.bytes});
            let attached = |a: &somatic::internal::recording::Attached| json!({"name": a.name, "media_type": a.media_type, "bytes": a.bytes});
            let about = json!({
                "kind": "MCAP", "bytes": size(path), "taxels": reader.taxels().len(), "posed_frames": survey.posed,
                "topics": survey.topics.iter().map(topic).collect::<Vec<_>>(),
                "attached": reader.attached().iter().map(attached).collect::<Vec<_>>(),
                "ended": reader.has_end(), "losses": reader.losses(), "notes": reader.notices(),
            });
            joined(about, times(&survey.rhythm))
        }
        SourceSpec::Ros2Mcap(bag) => {
            let survey = BagSurvey::read(&bag.path, |_| {})?;
            let topics = survey.topics.iter().filter(|t| bag.topics.is_empty() || bag.topics.contains(&t.name));
            let seconds = |ns: u64| ns as f64 / 1e9;
            let topics = topics.map(|t| {
                json!({
                    "topic": t.name, "type": t.kind, "encoding": t.encoding, "messages": t.messages, "bytes": t.bytes,
                    "start": t.span_ns.map(|span| seconds(span[0])), "end": t.span_ns.map(|span| seconds(span[1])),
                    "rate_hz": t.rate_hz(),
                })
            });
            json!({
                "kind": "bag of ROS 2", "files": survey.files, "bytes": survey.bytes,
                "topics": topics.collect::<Vec<_>>(), "losses": survey.losses,
            })
        }
        _ => {
            let (mut source, kind, layout): (Box<dyn Source>, &str, Option<Layout>) = match &spec {
                SourceSpec::Vendor(path) => {
                    let source = VendorSource::open(path, options)?;
                    let (kind, layout) = (source.format().title(), source.layout().clone());
                    (Box::new(source), kind, Some(layout))
                }
                spec => {
                    (Box::new(CsvSource::open(spec.file().unwrap_or(Path::new("")), options.rate_hz)?), "CSV", None)
                }
            };
            let Some(rhythm) = of_frames(&mut *source, raised)? else { return Ok(Value::Null) };
            let losses = source.losses();
            let about = json!({
                "kind": kind, "bytes": spec.file().map(size), "taxels": source.taxels().len(), "ended": losses.is_empty(),
                "losses": losses, "notes": source.notices(), "unit": layout.as_ref().map(|layout| layout.unit.symbol()),
                "panels": layout.as_ref().map(layout_of),
            });
            joined(about, times(&rhythm))
        }
    })
}

#[pyfunction]
#[pyo3(name = "_info")]
pub(crate) fn info(py: Python<'_>, source: &str, rate_hz: Option<f64>) -> PyResult<String> {
    let options = VendorOptions { rate_hz, ..VendorOptions::default() };
    let mut raised = None;
    let known = free(py, || known(source, &options, &mut raised)).or_raise_of(py, Path::new(source))?;
    if raised.is_some() { Err(interrupted(raised)) } else { Ok(known.to_string()) }
}

#[pyfunction]
#[pyo3(name = "_inspect")]
pub(crate) fn inspect(py: Python<'_>, body: &PyBody, contact_tolerance_m: Option<f64>) -> PyResult<String> {
    let seen = free(py, || {
        let body = &*body.inner;
        let mut findings = body.findings.clone();
        let fields = FieldSet::new(body).map_or_else(
            |error| {
                findings.push(error.to_string());
                Vec::new()
            },
            |set| set.fields,
        );
        let odd = lint_with_progress(body, &fields, DrawnPoses::of_own_joints(body).as_ref(), &mut |_| {});
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
        json!({
            "body": body.name, "taxels": body.taxels.len(), "links": links.collect::<Vec<_>>(),
            "fields": fields.collect::<Vec<_>>(), "edges": graph.edges().count(),
            "islands": graph.islands(body).iter().filter(|island| island.len() > 1).count(),
            "skin": {"area": area, "covered": seen},
            "holes": covered.holes.iter().map(|hole| {
                json!({"link": name(hole.link), "position": hole.position_in_link.to_array(), "area": hole.area})
            }).collect::<Vec<_>>(),
            "near_at_rest": overlaps.len(), "findings": findings,
        })
    });
    Ok(seen.to_string())
}

/// The unit of a quantity of touches that is a list, and what it is.
fn list_of(name: &str) -> Option<(&'static str, &'static str)> {
    Some(match name {
        "links" => ("1", "The links that it lies on, with their shares of its total."),
        "fields" => ("1", "The fields that hold parts of it, with their shares of its total."),
        "taxels" => ("", "The ids of its taxels."),
        "wrench" => ("N, N m", "Force and torque on each link that it lies on."),
        "fit_sigmas" => ("", "The standard deviations of the fit's place, force, direction, width and length."),
        _ => return None,
    })
}

#[pyfunction]
#[pyo3(name = "_outputs")]
pub(crate) fn outputs() -> String {
    let touch = |name: String| {
        let output = TouchOutputs::named(&name)?;
        let column = TOUCH_COLUMNS.iter().find(|column| column.output == output);
        let (unit, components, what) = match (list_of(&name), column) {
            (Some((unit, what)), _) => (unit, 0, what),
            (None, column) => {
                let column = column?;
                (column.unit.symbol(), column.components, column.help.trim())
            }
        };
        Some(json!({
            "name": format!("touches.{name}"), "unit": unit, "components": components,
            "default": TouchOutputs::USUAL.contains(output), "what": what,
        }))
    };
    let field = |column: &somatic::Column| {
        json!({
            "name": column.name, "unit": column.unit.symbol(), "components": column.components,
            "default": Outputs::USUAL.contains(column.output), "what": column.help.trim(),
        })
    };
    let contacts = json!({
        "name": "self_contacts", "unit": "", "components": 0, "default": false,
        "what": "Where the robot touches itself: pairs of touches of two links; needs poses.",
    });
    let rows = TouchOutputs::all().names().filter_map(touch).chain(COLUMNS.iter().map(field)).chain([contacts]);
    Value::from(rows.collect::<Vec<_>>()).to_string()
}
