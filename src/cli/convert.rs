//! `somatic convert`: recordings and skins from one kind of file to another.

mod skin;

use std::path::{Path, PathBuf};
use std::slice;
use std::sync::atomic::Ordering;

use clap::Args;
use somatic::body::Modality;
use somatic::internal::convert::{FrameFile, is_body};
use somatic::internal::limits::{self, MAX_TOML_BYTES};
use somatic::internal::recording::{BODY, CALIBRATION};
use somatic::internal::run::left_out;
use somatic::internal::setup::FilesRead;
use somatic::internal::setup::attached::{self, body_bytes, file_name};
use somatic::internal::setup::bodies::load_body;
use somatic::internal::setup::overlaid::{How, kinds_in, overlaid};
use somatic::internal::setup::{open_mapped, source_of};
use somatic::internal::signal::Channel;
use somatic::recording::Reader;
use somatic::source::{SimulatedSource, Source, SourceSpec, VendorOptions, VendorSource};
use somatic::{Body, Error, Result};

use super::bar::Bar;
use super::exports::ExportFlags;
use super::interrupt::stop_soon_on_signal;
use super::scene::{in_flags, said};
use super::stdio::{say, tell_losses};
use super::words::count;

const EXAMPLES: &str = "\
Examples:
  somatic convert touch.csv touch.mcap --body robot.glb --calibration robot.toml
  somatic convert touch.mcap touch.csv        or csv:- for standard output
  somatic convert insoles.lst insoles.mcap    a pressure system's export, with its sensors and unit
  somatic convert insoles.lst -o body.glb     its sensors as a body, for zones and pictures
  somatic convert cut-off.mcap whole.mcap     what is whole in it, with an end
  somatic convert skin.glb -o skin.csv        the taxels of a body as a table
  somatic convert skin.glb -o skin.urdf       as tactile sensors of a robot

Frames come through bit for bit. A CSV has no place for poses, body and calibration, an MCAP gets
no percepts: make them with `somatic run`. Of a skin, taxels come back by `somatic author --csv-skin`
and `--urdf-skin`: id, link, place, normal and area; fields are made anew, meshes stay behind.";

/// Turn a recording or a skin into another format.
///
/// Recordings are CSV or MCAP, either way; the skin of a body becomes a table or a URDF.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The recording, or the body.
    ///
    /// A recording is csv:FILE, mcap:FILE, sim:FILE.toml, or just a .csv, a .mcap or a pressure system's export. A
    /// body is a .glb or .gltf file, or the bundled hand, sensing-hand, mat or humanoid.
    #[arg(value_name = "IN")]
    from: String,

    /// The output: of a recording csv:FILE or mcap:FILE, or just a .csv or .mcap, or its body as a .glb; of a body a .csv or a .urdf.
    #[arg(value_name = "OUT", required_unless_present = "output")]
    to: Option<String>,

    /// The same as OUT.
    #[arg(short, long, value_name = "OUT", conflicts_with = "to")]
    output: Option<String>,

    /// The robot to put into an MCAP: a .glb or .gltf file, or a bundled body [default: the recording's own].
    #[arg(long, value_name = "BODY")]
    body: Option<String>,

    /// The calibration to put into an MCAP [default: the recording's own].
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,

    #[command(flatten)]
    export: ExportFlags,

    /// Replace OUT if it is there.
    #[arg(long)]
    force: bool,
}

pub(super) fn convert(arguments: &Arguments) -> Result<u8> {
    let to_name = arguments.to.as_deref().or(arguments.output.as_deref()).unwrap_or_default();
    if is_body(&arguments.from) {
        let is_plain = arguments.body.is_none() && arguments.calibration.is_none();
        if !is_plain || arguments.export.options()? != VendorOptions::default() {
            return Err(Error::usage("a body is converted without the flags for recordings; leave them out"));
        }
        return skin::convert(&arguments.from, to_name, arguments.force);
    }
    if arguments.from == "-" || arguments.from.starts_with("serial:") {
        return Err(Error::usage("a live source is not a recording; record it with `somatic run`, and convert that")
            .at(&arguments.from));
    }
    let options = arguments.export.options()?;
    let kinds: &[&str] = match options.map {
        Some(_) => &["ndjson", "mcap", "ros2-mcap"],
        None => &["csv", "mcap", "export", "sim"],
    };
    let from = source_of(&arguments.from, kinds, &options);
    let from = from.map_err(|e| e.at(format!("recording `{}`", arguments.from)))?;
    let is_kind = ["csv:", "mcap:"].iter().any(|kind| to_name.starts_with(kind));
    if !is_kind && Path::new(to_name).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("glb")) {
        if arguments.body.is_some() || arguments.calibration.is_some() {
            return Err(Error::usage("a body has no place for --body and --calibration; leave them out").at(to_name));
        }
        return skin::of_recording((&arguments.from, &from), &options, to_name, arguments.force);
    }
    let to = match to_name {
        // As a source it is another kind.
        "csv:-" => SourceSpec::Csv("-".into()),
        _ => SourceSpec::one_of(to_name, &["csv", "mcap"]).map_err(|e| e.at(format!("output `{to_name}`")))?,
    };
    let (SourceSpec::Csv(to_path) | SourceSpec::Mcap(to_path)) = &to else {
        unreachable!("it is of one of these kinds");
    };
    let read = FilesRead::default().named(slice::from_ref(&arguments.from)).files(&arguments.calibration);
    let read = read.files(&arguments.export.layout).files(&arguments.export.map);
    let output = read.bodies(&arguments.body).outputs(arguments.force).add(to_path)?;
    let is_csv = matches!(to, SourceSpec::Csv(_));
    let (mut source, attached) = opened(arguments, &from, &options, is_csv)?;
    source.report_stale();
    let place = output.name().display().to_string();
    if is_csv && (arguments.body.is_some() || arguments.calibration.is_some()) {
        return Err(Error::usage("a CSV has no place for --body and --calibration").at(to_path.display()));
    }
    let taxels = source.taxels();
    let mut file = if is_csv { FrameFile::csv(output, taxels)? } else { FrameFile::mcap(output, taxels, &attached)? };
    let stop = stop_soon_on_signal()?;
    let mut bar = Bar::new("converting");
    let copied = file.copy(&mut *source, |_, share| {
        bar.show(share);
        !stop.load(Ordering::Relaxed)
    })?;
    drop(bar);
    source.notices().iter().for_each(|notice| say(notice));
    if !copied.is_whole {
        let absent = file.finish_early()?;
        let mut losses = source.losses();
        let progress = source.progress();
        losses.push(left_out(&arguments.from, copied.frames, copied.last_s, progress, absent.as_slice()));
        return Ok(tell_losses(&losses));
    }
    let names: Vec<&str> = attached.iter().map(|(name, ..)| name.as_str()).collect();
    let left_behind = file.left_behind(&*source, &copied, &names);
    file.finish()?;
    say(&format!("{} in {place}", count(copied.frames, "frame")));
    left_behind.iter().for_each(|what| say(what));
    Ok(tell_losses(&source.losses()))
}

/// The recording that is converted, and what is to lie beside its frames.
fn opened(
    arguments: &Arguments,
    from: &SourceSpec,
    options: &VendorOptions,
    is_csv: bool,
) -> Result<(Box<dyn Source + Send>, Vec<Beside>)> {
    Ok(match from {
        SourceSpec::Vendor(path) => {
            let export = VendorSource::open(path, options)?;
            let attached = files(arguments, from, Some(&export))?;
            (Box::new(export), attached)
        }
        _ if options.map.is_some() => {
            let mut mapped = open_mapped(from, options).map_err(in_flags)?;
            let mut attached = files(arguments, from, None)?;
            if let Some(name) = &arguments.body {
                mapped = mapped.for_body(&Channel::all_of(&load_body(name)?))?;
            } else if !is_csv {
                say(&mapped.about_body());
                attached.push(("map.glb".to_owned(), BODY.to_owned(), mapped.body()?));
            }
            (Box::new(mapped), attached)
        }
        _ => (from.open(&[], options)?, files(arguments, from, None)?),
    })
}

/// What lies beside frames: its name, its media type, its bytes.
type Beside = (String, String, Vec<u8>);

/// The taxels of the body in the recording that is converted, ids and what they measure; none where it has none: those of exports are of
/// pressure.
fn kinds_of(from: &SourceSpec) -> Result<Vec<(u32, Modality)>> {
    let SourceSpec::Mcap(path) = from else { return Ok(Vec::new()) };
    let Some((name, bytes)) = attached::body(path)? else { return Ok(Vec::new()) };
    let body = Body::from_bytes(&name, &bytes).map_err(|e| e.at(path.display()))?;
    Ok(kinds_in(&body))
}

/// What is to lie beside the frames. What is named comes before what the recording or the
/// simulation has.
fn files(arguments: &Arguments, from: &SourceSpec, export: Option<&VendorSource>) -> Result<Vec<Beside>> {
    let mut files = Vec::new();
    if let Some(body) = &arguments.body {
        files.push((file_name(body), BODY.to_owned(), body_bytes(body)?));
    }
    if let Some(path) = &arguments.calibration {
        let given = limits::read_to_string(path, MAX_TOML_BYTES).map_err(|e| Error::io(path, &e))?;
        let own = match (export, from) {
            (Some(export), _) => export.calibration().map(|text| (export.path().to_owned(), text)),
            (None, SourceSpec::Mcap(file)) if arguments.body.is_none() => {
                attached::calibration(file, &said())?.map(|text| (file.clone(), text))
            }
            _ => None,
        };
        let text = match own {
            Some((of, own)) => {
                let taxels = kinds_of(from)?;
                overlaid((&of, &own), (path, &given), &taxels, How::Laid, &said())?
            }
            None => given,
        };
        files.push((CALIBRATION.to_owned(), "application/toml".to_owned(), text.into_bytes()));
    }
    if let SourceSpec::Sim(path) = from {
        let simulation = SimulatedSource::open(path)?;
        if arguments.body.is_none() {
            let name = &simulation.body().name;
            files.push((file_name(name), BODY.to_owned(), body_bytes(name)?));
        }
        if arguments.calibration.is_none() {
            let bytes = simulation.calibration().into_bytes();
            files.push((CALIBRATION.to_owned(), "application/toml".to_owned(), bytes));
        }
    }
    if let Some(export) = export {
        if arguments.body.is_none() {
            files.push((export.body_name(), BODY.to_owned(), export.body()?));
        }
        if let Some(text) = export.calibration().filter(|_| arguments.calibration.is_none()) {
            files.push((CALIBRATION.to_owned(), "application/toml".to_owned(), text.into_bytes()));
        }
    }
    if let SourceSpec::Mcap(path) = from {
        let mut reader = Reader::open(path)?;
        if arguments.body.is_none() || arguments.calibration.is_none() {
            // Refuses what is too damaged to tell.
            reader.find_attached(|_| false)?;
        }
        for attached in reader.attached().to_vec() {
            let given = match attached.media_type.as_str() {
                BODY => arguments.body.is_some(),
                _ => attached.name == CALIBRATION && arguments.calibration.is_some(),
            };
            if !given {
                let bytes = reader.bytes_of(&attached)?;
                files.push((attached.name, attached.media_type, bytes));
            }
        }
    }
    Ok(files)
}
