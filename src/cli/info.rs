//! `somatic info`: what is in a recording.

mod bag;
mod contacts;

use std::path::Path;

use clap::Args;
use serde_json::Value;
use somatic::internal::contents::{Contacts, Contents, bag_as_json};
use somatic::internal::recording::BagSurvey;
use somatic::internal::setup::attached;
use somatic::internal::setup::{open_mapped, source_of};
use somatic::internal::source::Layout;
use somatic::recording::Reader;
use somatic::source::{CsvSource, Source, SourceSpec, VendorSource};
use somatic::{Body, Calibration, Error, Result};

use super::bar::Bar;
use super::exports::ExportFlags;
use super::scene::{in_flags, said};
use super::stdio::{DONE, LOST, print, say};
use super::table::{plain, shown};
use super::words::{number, one_line, size_words, span, title};

/// The kinds of recordings, and those that hold arrays within messages.
const KINDS: &[&str] = &["csv", "mcap", "ros2-mcap", "export"];
const MAPPED: &[&str] = &["ndjson", "mcap", "ros2-mcap"];

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

pub(super) fn info(arguments: &Arguments) -> Result<u8> {
    let mut bar = Bar::new("reading");
    let options = arguments.export.options()?;
    let recording = source_of(&arguments.recording, if options.map.is_some() { MAPPED } else { KINDS }, &options);
    let (known, contacts) = match recording.map_err(|e| e.at(format!("recording `{}`", arguments.recording)))? {
        SourceSpec::Mcap(path) => {
            if arguments.export.rate.is_some() {
                return Err(Error::usage("--rate is for CSV recordings without a column `t`; leave it out here"));
            }
            let mut known = Contents::of_mcap(&path, &mut Reader::open(&path)?, |share| bar.show(share))?;
            // What is attached may be damaged, and the rest is described all the same.
            let contacts = Contacts::of_mcap(&path, &said(), |_| true).unwrap_or_else(|e| {
                known.losses.push(e.to_string());
                None
            });
            (known, contacts)
        }
        spec @ (SourceSpec::Ros2Mcap(_) | SourceSpec::Ndjson(_)) if options.map.is_some() => {
            let mut source = open_mapped(&spec, &options).map_err(in_flags)?;
            let path = spec.file().unwrap_or(Path::new("")).to_owned();
            (of_frames("messages", &path, &mut source, None, &mut bar)?, None)
        }
        SourceSpec::Ros2Mcap(bag) => {
            let mut survey = BagSurvey::read(&bag.path, |share| bar.show(share))?;
            survey.topics.retain(|topic| bag.topics.is_empty() || bag.topics.contains(&topic.name));
            drop(bar);
            let json = arguments.json.then(|| format!("{}\n", bag_as_json(&survey)));
            print(&json.unwrap_or_else(|| bag::text(&arguments.recording, &survey)))?;
            return Ok(ended(&survey.losses));
        }
        SourceSpec::Csv(path) => {
            let mut source = CsvSource::open(&path, options.rate_hz)?;
            (of_frames("CSV", &path, &mut source, None, &mut bar)?, None)
        }
        SourceSpec::Vendor(path) => {
            let mut source = VendorSource::open(&path, &options)?;
            let layout = source.layout().clone();
            let body = Body::from_bytes(&source.body_name(), &source.body()?)?;
            let ids = source.taxels().to_vec();
            let calibration = source.calibration().map(|text| Calibration::parse(&text, &ids)).transpose()?;
            let mut contacts = Contacts::new(&body, calibration, &source)?;
            let known = of_frames(source.format().title(), &path, &mut source, Some(&mut contacts), &mut bar)?;
            (Contents { layout: Some(layout), ..known }, Some(contacts))
        }
        _ => unreachable!("it is of one of these kinds"),
    };
    drop(bar);
    print(&match arguments.json {
        true => format!("{}\n", as_json(&known, contacts.as_ref())),
        false => text(&arguments.recording, &known, contacts.as_ref()),
    })?;
    known.notes.iter().for_each(|note| say(note));
    Ok(ended(&known.losses))
}

/// Says what was lost; gives the exit code.
fn ended(losses: &[String]) -> u8 {
    losses.iter().for_each(|loss| say(loss));
    if losses.is_empty() { DONE } else { LOST }
}

/// What a recording of nothing but frames has, which is read to its end, and what `contacts` sees there.
fn of_frames(
    kind: &'static str,
    path: &Path,
    source: &mut dyn Source,
    mut contacts: Option<&mut Contacts>,
    bar: &mut Bar,
) -> Result<Contents> {
    let known = Contents::of_frames(kind, path, source, |frame, share| {
        if let Some(contacts) = &mut contacts {
            contacts.see(frame)?;
        }
        bar.show(share);
        Ok(true)
    })?;
    if let Some(contacts) = contacts {
        contacts.finish()?;
    }
    Ok(known.expect("it goes on to the end"))
}

/// The panels of an export, in words.
fn panels(layout: &Layout) -> String {
    let words = layout.panels.iter().map(|panel| format!("{} {}", panel.name, panel.cells.len()));
    let placed = if layout.is_placed() { "" } else { "; the file does not say where they are" };
    format!(": {}{placed}", words.collect::<Vec<_>>().join(", "))
}

/// What is known, with the contacts of each field.
fn as_json(known: &Contents, contacts: Option<&Contacts>) -> Value {
    let mut json = known.as_json();
    json["fields"] = contacts.map_or(Value::Null, |contacts| contacts.as_json().into());
    json
}

fn text(name: &str, known: &Contents, contacts: Option<&Contacts>) -> String {
    let Contents { kind, bytes, taxels, survey, attached, has_end, losses, layout, .. } = known;
    let rhythm = &survey.rhythm;
    let mut text = format!("{}\n", title(name));
    let mut line = |what: &str, value: String| text += &format!("  {what:<12}{}\n", one_line(&value));
    line("kind", format!("{kind}, {}{}", size_words(*bytes), if *has_end { "" } else { ", never ended" }));
    let rate = rhythm.rate_hz().map_or(String::new(), |rate| format!(" at {} Hz", number(rate)));
    let whole = if losses.is_empty() { "" } else { " whole" };
    line("frames", format!("{}{whole}{rate}", rhythm.frames));
    if let (Some(duration), Some([start, _])) = (known.duration_s(), rhythm.span_s) {
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
    text += &contacts.map_or(String::new(), contacts::text);
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
