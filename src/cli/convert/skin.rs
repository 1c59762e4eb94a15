//! The skin of a body as a table or a URDF.

use std::path::Path;
use std::slice;

use somatic::internal::convert::SkinFormat;
use somatic::internal::setup::FilesRead;
use somatic::internal::setup::attached;
use somatic::internal::setup::bodies::load_body;
use somatic::internal::setup::open_mapped;
use somatic::source::{SourceSpec, VendorOptions, VendorSource};
use somatic::{Body, Error, Result};

use crate::cli::stdio::{DONE, say};
use crate::cli::words::count;

/// Writes the taxels of the body `from` to `to`.
pub(super) fn convert(from: &str, to: &str, force: bool) -> Result<u8> {
    let path = Path::new(to.strip_prefix("csv:").unwrap_or(to));
    let format = if to == "csv:-" { Some(SkinFormat::Table) } else { SkinFormat::of(path) };
    let Some(format) = format else {
        return Err(Error::usage("the skin of a body becomes a .csv or a .urdf").at(format!("output `{to}`")));
    };
    let output = FilesRead::default().bodies([&from.to_owned()]).outputs(force).add(path)?;
    let body = load_body(from)?;
    if body.taxels.is_empty() {
        let what = "it has no taxels; place some on it: somatic author --taxels 500";
        return Err(Error::failed(what).at(from));
    }
    let (text, notes) = format.text(&body);
    let name = output.name().display().to_string();
    output.write(text.as_bytes())?;
    say(&format!("{} in {name}", count(format.taxels(&body) as u64, "taxel")));
    notes.iter().chain(&format.without_fields(&body)).for_each(|note| say(note));
    Ok(DONE)
}

/// Writes the body that the recording `from` has, which is called `name` and read with `options`, to `to`.
pub(super) fn of_recording(
    (name, from): (&String, &SourceSpec),
    options: &VendorOptions,
    to: &str,
    force: bool,
) -> Result<u8> {
    let read = FilesRead::default().named(slice::from_ref(name)).files(&options.layout);
    let output = read.outputs(force).add(to)?;
    let (name, bytes) = match from {
        SourceSpec::Vendor(path) => {
            let export = VendorSource::open(path, options)?;
            if !export.layout().is_placed() {
                let what = "the file does not say where its sensors are; give their places as --layout";
                return Err(Error::failed(what).at(path.display()));
            }
            (export.body_name(), export.body()?)
        }
        SourceSpec::Mcap(path) => attached::body(path)?.ok_or_else(|| {
            Error::failed("it has no body; record it with one: somatic run --body BODY").at(path.display())
        })?,
        mapped if options.map.is_some() => {
            let source = open_mapped(mapped, options)?;
            say(&source.about_body());
            (name.clone(), source.body()?)
        }
        _ => return Err(Error::failed("it has no body; make one: somatic author --help").at(name)),
    };
    let body = Body::from_bytes(&name, &bytes)?;
    let name = output.name().display().to_string();
    output.write(&bytes)?;
    say(&format!("{} in {name}", count(body.taxels.len() as u64, "taxel")));
    Ok(DONE)
}
