//! `somatic info`: what is in a recording.

mod bag;
mod contacts;

use clap::Args;
use serde_json::{Value, json};
use somatic::internal::recording::{Attached, BagSurvey, Rhythm, Survey};
use somatic::internal::setup::attached;
use somatic::internal::setup::source_of;
use somatic::internal::source::Layout;
use somatic::recording::Reader;
use somatic::source::{CsvSource, Source, SourceSpec, VendorSource};
use somatic::{Body, Calibration, Error, Frame, Result};

use self::contacts::Contacts;
use super::bar::Bar;
use super::exports::ExportFlags;
use super::scene::said;
use super::stdio::{DONE, LOST, print, say};
use super::table::{plain, shown};
use super::words::{between_s, number, one_line, size_words, span, title};

const EXAMPLES: &str = "\
Examples:
  somatic info touch.mcap
  somatic info touch.csv --json | jq .rate_hz
  somatic info insoles.csv                    a pressure system's export, by its content
  somatic info ros2-mcap:bag                  the topics of a ROS 2 bag

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 done but some of the recording could not be read.";

/// Describe a recording: length, rate, gaps, and what else it holds.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The recording: mcap:FILE, csv:FILE, ros2-mcap:PATH for a ROS 2 bag, a pressure system's export, or just the
    /// file.
    #[arg(value_name = "FILE")]
    recording: String,

    #[command(flatten)]
    export: ExportFlags,

    /// Print JSON: times in seconds, sizes in bytes.
    #[arg(long)]
    json: bool,
}

struct Known {
    kind: &'static str,
    bytes: u64,
    taxels: usize,
    survey: Survey,
    attached: Vec<Attached>,
    has_end: bool,
    losses: Vec<String>,
    /// What was understood of a table.
    notes: Vec<String>,
    /// Of a pressure system's export.
    layout: Option<Layout>,
    /// Of a recording that has its body.
    contacts: Option<Contacts>,
}

pub(super) fn info(arguments: &Arguments) -> Result<u8> {
    let mut bar = Bar::new("reading");
    let options = arguments.export.options()?;
    let recording = source_of(&arguments.recording, &["csv", "mcap", "ros2-mcap", "export"], &options);
    let known = match recording.map_err(|e| e.at(format!("recording `{}`", arguments.recording)))? {
        SourceSpec::Mcap(path) => {
            if arguments.export.rate.is_some() {
                return Err(Error::usage("--rate is for CSV recordings without a column `t`; leave it out here"));
            }
            let mut reader = Reader::open(&path)?;
            let survey = Survey::read(&mut reader, |share| bar.show(share))?;
            let mut losses = reader.losses();
            // What is attached may be damaged, and the rest is described all the same.
            let contacts = recorded(&path).unwrap_or_else(|e| {
                losses.push(e.to_string());
                None
            });
            Known {
                kind: "MCAP",
                bytes: size(&path),
                taxels: reader.taxels().len(),
                attached: reader.attached().to_vec(),
                has_end: reader.has_end(),
                losses,
                notes: reader.notices(),
                layout: None,
                contacts,
                survey,
            }
        }
        SourceSpec::Ros2Mcap(bag) => {
            let mut survey = BagSurvey::read(&bag.path, |share| bar.show(share))?;
            survey.topics.retain(|topic| bag.topics.is_empty() || bag.topics.contains(&topic.name));
            drop(bar);
            let json = arguments.json.then(|| format!("{}\n", bag::as_json(&survey)));
            print(&json.unwrap_or_else(|| bag::text(&arguments.recording, &survey)))?;
            return Ok(ended(&survey.losses));
        }
        SourceSpec::Csv(path) => {
            let mut source = CsvSource::open(&path, options.rate_hz)?;
            of_frames("CSV", size(&path), &mut source, None, None, &mut bar)?
        }
        SourceSpec::Vendor(path) => {
            let mut source = VendorSource::open(&path, &options)?;
            let layout = source.layout().clone();
            let body = Body::from_bytes(&source.body_name(), &source.body()?)?;
            let ids = source.taxels().to_vec();
            let calibration = source.calibration().map(|text| Calibration::parse(&text, &ids)).transpose()?;
            let contacts = Contacts::new(&body, calibration, &source)?;
            of_frames(source.format().title(), size(&path), &mut source, Some(layout), Some(contacts), &mut bar)?
        }
        _ => unreachable!("it is of one of these kinds"),
    };
    drop(bar);
    print(&if arguments.json { format!("{}\n", as_json(&known)) } else { text(&arguments.recording, &known) })?;
    known.notes.iter().for_each(|note| say(note));
    Ok(ended(&known.losses))
}

/// Says what was lost; gives the exit code.
fn ended(losses: &[String]) -> u8 {
    losses.iter().for_each(|loss| say(loss));
    if losses.is_empty() { DONE } else { LOST }
}

/// What a recording of nothing but frames has, which is read to its end.
fn of_frames(
    kind: &'static str,
    bytes: u64,
    source: &mut dyn Source,
    layout: Option<Layout>,
    mut contacts: Option<Contacts>,
    bar: &mut Bar,
) -> Result<Known> {
    let mut rhythm = Rhythm::default();
    let mut frame = Frame::missing(0.0, source.taxels().len());
    while source.next_frame(&mut frame)? {
        rhythm.see(frame.t_s);
        if let Some(contacts) = &mut contacts {
            contacts.see(&frame)?;
        }
        bar.show(source.progress().unwrap_or(0.0));
    }
    rhythm.finish();
    if let Some(contacts) = &mut contacts {
        contacts.finish()?;
    }
    let (losses, notes) = (source.losses(), source.notices());
    Ok(Known {
        notes,
        kind,
        bytes,
        taxels: source.taxels().len(),
        survey: Survey { rhythm, ..Survey::default() },
        attached: Vec::new(),
        has_end: losses.is_empty(),
        losses,
        layout,
        contacts,
    })
}

/// The contacts in the recording at `path`, if it has its body.
fn recorded(path: &std::path::Path) -> Result<Option<Contacts>> {
    let Some((name, bytes)) = attached::body(path)? else { return Ok(None) };
    let Ok(body) = Body::from_bytes(&name, &bytes) else { return Ok(None) };
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = attached::calibration(path, &said())?.map(|text| Calibration::parse(&text, &ids)).transpose();
    let mut reader = Reader::open(path)?;
    // What cannot be run is described all the same.
    let Ok(Ok(mut contacts)) = calibration.map(|calibration| Contacts::new(&body, calibration, &reader)) else {
        return Ok(None);
    };
    let mut frame = Frame::missing(0.0, reader.taxels().len());
    while reader.next_frame(&mut frame)? {
        contacts.see(&frame)?;
    }
    contacts.finish()?;
    Ok(Some(contacts))
}

/// The panels of an export, in words.
fn panels(layout: &Layout) -> String {
    let words = layout.panels.iter().map(|panel| format!("{} {}", panel.name, panel.cells.len()));
    let placed = if layout.is_placed() { "" } else { "; the file does not say where they are" };
    format!(": {}{placed}", words.collect::<Vec<_>>().join(", "))
}

fn size(path: &std::path::Path) -> u64 {
    std::fs::metadata(path).map_or(0, |metadata| metadata.len())
}

fn duration_s(rhythm: &Rhythm) -> Option<f64> {
    rhythm.span_s.map(|[first, last]| between_s(first, last))
}

fn as_json(known: &Known) -> Value {
    let Known { kind, bytes, taxels, survey, attached, has_end, losses, layout, contacts, notes } = known;
    let rhythm = &survey.rhythm;
    let topics: Vec<Value> = survey
        .topics
        .iter()
        .map(|t| json!({"topic": t.name, "encoding": t.encoding, "messages": t.messages, "bytes": t.bytes}))
        .collect();
    let attached: Vec<Value> =
        attached.iter().map(|a| json!({"name": a.name, "media_type": a.media_type, "bytes": a.bytes})).collect();
    json!({
        "kind": kind, "bytes": bytes, "taxels": taxels, "frames": rhythm.frames,
        "start": rhythm.span_s.map(|span| span[0]), "duration": duration_s(rhythm), "rate_hz": rhythm.rate_hz(),
        "gaps": rhythm.gaps, "longest_gap": rhythm.longest_gap_s.map(|gap| json!({
            "seconds": between_s(gap[1], gap[1] + gap[0]), "after": gap[1],
        })),
        "backwards": rhythm.backwards, "posed_frames": survey.posed, "topics": topics, "attached": attached,
        "ended": has_end, "losses": losses, "notes": notes,
        "fields": contacts.as_ref().map(Contacts::as_json),
        "unit": layout.as_ref().map(|layout| layout.unit.symbol()),
        "panels": layout.as_ref().map(|layout| layout.panels.iter().map(|panel| json!({
            "name": panel.name, "taxels": panel.cells.len(), "placed": panel.is_placed,
            "area": panel.cells.iter().map(|cell| cell.area_m2).sum::<f64>(),
        })).collect::<Vec<_>>()),
    })
}

fn text(name: &str, known: &Known) -> String {
    let Known { kind, bytes, taxels, survey, attached, has_end, losses, layout, contacts, .. } = known;
    let rhythm = &survey.rhythm;
    let mut text = format!("{}\n", title(name));
    let mut line = |what: &str, value: String| text += &format!("  {what:<12}{}\n", one_line(&value));
    line("kind", format!("{kind}, {}{}", size_words(*bytes), if *has_end { "" } else { ", never ended" }));
    let rate = rhythm.rate_hz().map_or(String::new(), |rate| format!(" at {} Hz", number(rate)));
    let whole = if losses.is_empty() { "" } else { " whole" };
    line("frames", format!("{}{whole}{rate}", rhythm.frames));
    if let (Some(duration), Some([start, _])) = (duration_s(rhythm), rhythm.span_s) {
        line("duration", format!("{} ({duration} s from t = {start} s)", span(duration)));
    }
    line("taxels", format!("{taxels}{}", layout.as_ref().map_or(String::new(), panels)));
    if let Some(layout) = layout {
        line("unit", layout.unit.to_string());
    }
    line(
        "gaps",
        match rhythm.longest_gap_s {
            Some([longest, after]) => {
                format!("{}, the longest {} after t = {after} s", rhythm.gaps, span(longest))
            }
            None => "none".to_owned(),
        },
    );
    if rhythm.backwards > 0 {
        line("backwards", format!("time does not advance {} times", rhythm.backwards));
    }
    if survey.posed > 0 {
        line("poses", format!("in {} frames", survey.posed));
    }
    for file in attached {
        line("attached", format!("{} ({}, {})", file.name, file.media_type, size_words(file.bytes)));
    }
    text += &contacts.as_ref().map_or(String::new(), Contacts::text);
    if !survey.topics.is_empty() {
        let mut table = plain(["topic", "encoding", "messages", "size"], 2..4);
        for topic in &survey.topics {
            table.add_row([&topic.name, &topic.encoding, &topic.messages.to_string(), &size_words(topic.bytes)]);
        }
        text += "\n";
        text += &shown(&table);
    }
    text
}
