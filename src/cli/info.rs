//! `somatic info`: what is in a recording.

mod bag;
mod contacts;

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::Value;
use somatic::internal::contents::{ContactTable, Contacts, Contents, FoundContacts, Rule, Threshold, bag_as_json};
use somatic::internal::recording::BagSurvey;
use somatic::internal::scene_file::seconds;
use somatic::internal::setup::FilesRead;
use somatic::internal::setup::{open_mapped, source_of};
use somatic::internal::source::Layout;
use somatic::recording::Reader;
use somatic::source::{CsvSource, Source, SourceSpec, VendorSource};
use somatic::{Body, Calibration, Error, Result};

use self::contacts::text as contacts_text;
use super::bar::Bar;
use super::exports::ExportFlags;
use super::scene::{in_flags, said};
use super::stdio::{DONE, LOST, print, say};
use super::table::{plain, shown};
use super::words::{count, number, one_line, size_words, span, title};

/// The kinds of recordings, and those that hold arrays within messages.
const KINDS: &[&str] = &["csv", "mcap", "ros2-mcap", "export"];
const MAPPED: &[&str] = &["ndjson", "mcap", "ros2-mcap"];

const EXAMPLES: &str = "\
Examples:
  somatic info touch.mcap
  somatic info touch.csv --json | jq .rate_hz
  somatic info insoles.csv                    a pressure system's export, by its content
  somatic info a.csv b.csv --contacts steps.csv   a row for each contact of both
  somatic info ros2-mcap:bag                  the topics of a ROS 2 bag

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 done but some of the recording could not be read.";

/// Describe a recording: length, rate, gaps, and what else it holds.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The recordings: mcap:FILE, csv:FILE, ros2-mcap:PATH for a ROS 2 bag, a pressure system's export, or just the
    /// file.
    #[arg(value_name = "FILE", required = true)]
    recordings: Vec<String>,

    /// Write a table with a row for each contact of each field: onset, offset, peaks, impulse, area and path of the centre of pressure.
    ///
    /// It is for recordings that have their body: exports, and .mcap files. `recording` says which a row is of.
    #[arg(long, value_name = "TABLE.csv")]
    contacts: Option<PathBuf>,

    /// Where contacts begin: a force, or a share of the field's peak [default: 20N if a force of any field reaches it, else 5%].
    ///
    /// They end at half of it.
    #[arg(long, value_name = "FORCE|SHARE", value_parser = str::parse::<Threshold>)]
    threshold: Option<Threshold>,

    /// How long contacts last at least; shorter ones do not count.
    ///
    /// A bare number is in seconds.
    #[arg(long, value_name = "TIME", default_value = "50ms", value_parser = time)]
    shortest: f64,

    /// Replace the table if it is there.
    #[arg(long, requires = "contacts")]
    force: bool,

    #[command(flatten)]
    export: ExportFlags,

    /// Print JSON: times in seconds, sizes in bytes.
    #[arg(long)]
    json: bool,
}

/// A time span, also 0 without a unit.
fn time(text: &str) -> Result<f64> {
    if text.trim() == "0" { Ok(0.0) } else { seconds(text) }
}

/// What is known of a recording.
enum Known {
    Bag(BagSurvey),
    Frames(Box<Contents>, Option<FoundContacts>),
}

pub(super) fn info(arguments: &Arguments) -> Result<u8> {
    let read = FilesRead::default().named(&arguments.recordings).files(&arguments.recordings);
    let mut outputs = read.files(&arguments.export.layout).outputs(arguments.force);
    let table = arguments.contacts.as_ref().map(|path| outputs.add(path)).transpose()?;
    if table.is_some() {
        // What is known is printed there.
        outputs.add_standard_output()?;
    }
    let mut all_contacts = ContactTable::new()?;
    let (mut jsons, mut losses) = (Vec::new(), Vec::new());
    for (index, name) in arguments.recordings.iter().enumerate() {
        let known = known_of(name, arguments)?;
        let text = match &known {
            Known::Bag(survey) if arguments.json => {
                jsons.push(bag_as_json(survey));
                String::new()
            }
            Known::Frames(known, contacts) if arguments.json => {
                jsons.push(as_json(known, contacts.as_ref()));
                String::new()
            }
            Known::Bag(survey) => bag::text(name, survey),
            Known::Frames(known, contacts) => text(name, known, contacts.as_ref()),
        };
        print(&if index > 0 && !arguments.json { format!("\n{text}") } else { text })?;
        if let Known::Frames(known, _) = &known {
            known.notes.iter().for_each(|note| say(note));
        }
        if table.is_some() {
            let Known::Frames(_, Some(contacts)) = &known else {
                let what = "it has no body, which --contacts needs; convert it with one: somatic convert IN OUT.mcap --body BODY";
                return Err(Error::failed(what).at(name));
            };
            all_contacts.add(name, contacts)?;
        }
        losses.extend(match known {
            Known::Bag(survey) => survey.losses,
            Known::Frames(known, _) => known.losses,
        });
    }
    if arguments.json {
        let json = if jsons.len() == 1 { jsons.remove(0) } else { jsons.into() };
        print(&format!("{json}\n"))?;
    }
    if let Some(table) = table {
        let name = table.name().display().to_string();
        let contacts = count(all_contacts.rows(), "contact");
        table.write(&all_contacts.into_bytes()?)?;
        say(&format!("{contacts} in {name}"));
    }
    Ok(ended(&losses))
}

/// What is known of the recording called `name`.
fn known_of(name: &str, arguments: &Arguments) -> Result<Known> {
    let mut bar = Bar::new("reading");
    let options = arguments.export.options()?;
    let rule = Rule { threshold: arguments.threshold, shortest_s: arguments.shortest };
    let recording = source_of(name, if options.map.is_some() { MAPPED } else { KINDS }, &options);
    match recording.map_err(|e| e.at(format!("recording `{name}`")))? {
        SourceSpec::Mcap(path) => {
            if arguments.export.rate.is_some() {
                return Err(Error::usage("--rate is for CSV recordings without a column `t`; leave it out here"));
            }
            let mut known = Contents::of_mcap(&path, &mut Reader::open(&path)?, |share| bar.show(share))?;
            // What is attached may be damaged, and the rest is described all the same.
            let contacts = match Contacts::of_mcap(&path, &said(), rule, |_| true) {
                Err(e) if e.is_usage() => return Err(e),
                Err(e) => {
                    known.losses.push(e.to_string());
                    None
                }
                Ok(contacts) => contacts,
            };
            Ok(Known::Frames(Box::new(known), contacts))
        }
        spec @ (SourceSpec::Ros2Mcap(_) | SourceSpec::Ndjson(_)) if options.map.is_some() => {
            let mut source = open_mapped(&spec, &options).map_err(in_flags)?;
            let path = spec.file().unwrap_or(Path::new("")).to_owned();
            Ok(Known::Frames(Box::new(of_frames("messages", &path, &mut source, None, &mut bar)?), None))
        }
        SourceSpec::Ros2Mcap(bag) => {
            let mut survey = BagSurvey::read(&bag.path, |share| bar.show(share))?;
            survey.topics.retain(|topic| bag.topics.is_empty() || bag.topics.contains(&topic.name));
            Ok(Known::Bag(survey))
        }
        SourceSpec::Csv(path) => {
            let mut source = CsvSource::open(&path, options.rate_hz)?;
            Ok(Known::Frames(Box::new(of_frames("CSV", &path, &mut source, None, &mut bar)?), None))
        }
        SourceSpec::Vendor(path) => {
            let mut source = VendorSource::open(&path, &options)?;
            let layout = source.layout().clone();
            let body = Body::from_bytes(&source.body_name(), &source.body()?)?;
            let ids = source.taxels().to_vec();
            let calibration = source.calibration().map(|text| Calibration::parse(&text, &ids)).transpose()?;
            let mut contacts = Contacts::new(&body, calibration, &source)?;
            let known = of_frames(source.format().title(), &path, &mut source, Some(&mut contacts), &mut bar)?;
            let contacts = contacts.finish(rule)?;
            Ok(Known::Frames(Box::new(Contents { layout: Some(layout), ..known }), Some(contacts)))
        }
        _ => unreachable!("it is of one of these kinds"),
    }
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
    Ok(known.expect("it goes on to the end"))
}

/// The panels of an export, in words.
fn panels(layout: &Layout) -> String {
    let words = layout.panels.iter().map(|panel| format!("{} {}", panel.name, panel.cells.len()));
    let placed = if layout.is_placed() { "" } else { "; the file does not say where they are" };
    format!(": {}{placed}", words.collect::<Vec<_>>().join(", "))
}

/// What is known, with the contacts of each field.
fn as_json(known: &Contents, contacts: Option<&FoundContacts>) -> Value {
    let mut json = known.as_json();
    json["fields"] = contacts.map_or(Value::Null, |contacts| contacts.as_json().into());
    json
}

fn text(name: &str, known: &Contents, contacts: Option<&FoundContacts>) -> String {
    let Contents { kind, bytes, taxels, survey, attached, has_end, losses, layout, .. } = known;
    let rhythm = &survey.rhythm;
    let mut text = format!("{}\n", title(name));
    let mut line = |what: &str, value: String| text += &format!("  {what:<12}{}\n", one_line(&value));
    line("kind", format!("{kind}, {}{}", size_words(*bytes), if *has_end { "" } else { ", never ended" }));
    let rate = rhythm.rate_hz().map_or(String::new(), |rate| format!(" at {} Hz", number(rate)));
    let whole = if losses.is_empty() { "" } else { " whole" };
    line("frames", format!("{}{whole}{rate}", rhythm.frames));
    if let (Some(duration), Some([start, _])) = (known.duration_s(), rhythm.span_s) {
        let [length, start] = [duration, start].map(somatic::internal::plain::seconds);
        line("duration", format!("{} ({length} s from t = {start} s)", span(duration)));
    }
    line("taxels", format!("{taxels}{}", layout.as_ref().map_or(String::new(), panels)));
    if let Some(layout) = layout {
        line("unit", layout.unit.to_string());
    }
    line(
        "gaps",
        match rhythm.longest_gap_s {
            Some([longest, after]) => {
                format!(
                    "{}, the longest {} after t = {} s",
                    rhythm.gaps,
                    span(longest),
                    somatic::internal::plain::seconds(after)
                )
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
    text += &contacts.map_or(String::new(), contacts_text);
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
