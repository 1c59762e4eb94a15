//! Recordings that pressure systems export, as commands name them.

use std::path::PathBuf;

use clap::Args;
use somatic::signal::UnitOfP;
use somatic::source::{SourceSpec, VendorFormat, VendorOptions, VendorSource};
use somatic::{Error, Result};

use super::scene::{RunOptions, one_of};

/// What is said of a recording beside what its file says.
#[derive(Args, Clone, Debug, Default)]
pub(super) struct ExportFlags {
    /// Frames per second of a recording that has no times, in Hz.
    #[arg(long, value_name = "HZ")]
    pub(super) rate: Option<f64>,

    /// Read the file as a pressure system's export: xsensor, tekscan, emed, pliance, pedar, or matrix for plain numbers
    /// [default: as its content says].
    #[arg(long, value_name = "FORMAT", value_parser = one_of::<VendorFormat>(VendorFormat::WORDS))]
    pub(super) format: Option<VendorFormat>,

    /// Rows and columns of a frame of plain numbers, such as 31x11.
    #[arg(long, value_name = "ROWSxCOLUMNS")]
    pub(super) grid: Option<String>,

    /// From one row and column of them to the next, such as 8.6mm, or 8.6mm,5mm for rows and columns.
    #[arg(long, value_name = "LENGTH")]
    pub(super) pitch: Option<String>,

    /// The unit of the values where the file does not say it: kPa, mmHg, N/cm2, psi, N, and others.
    #[arg(long, value_name = "UNIT")]
    pub(super) unit: Option<String>,
}

impl ExportFlags {
    pub(super) fn options(&self) -> Result<VendorOptions> {
        Ok(VendorOptions {
            format: self.format,
            rate_hz: self.rate,
            grid: self.grid.as_deref().map(VendorOptions::grid_of).transpose()?,
            pitch_m: self.pitch.as_deref().map(VendorOptions::pitch_of).transpose()?,
            unit: self.unit.as_deref().map(str::parse::<UnitOfP>).transpose().map_err(|e| e.at("--unit"))?,
        })
    }
}

/// The source `text` as one of `kinds`, and what its content says that it is.
pub(super) fn source_of(text: &str, kinds: Option<&[&str]>, options: &VendorOptions) -> Result<SourceSpec> {
    let spec = match kinds {
        Some(kinds) => SourceSpec::one_of(text, kinds),
        None => text.parse(),
    };
    let spec = spec?.with_content(options);
    if let SourceSpec::Vendor(path) = &spec
        && path.exists()
        && !path.is_file()
        && !path.is_dir()
    {
        let what = "the file is read more than once, for its sensors and for its frames; save it first";
        return Err(Error::usage(what).at(path.display()));
    }
    Ok(spec)
}

impl RunOptions {
    pub(super) fn export_options(&self) -> Result<VendorOptions> {
        let Self { rate, format, grid, pitch, unit, .. } = self.clone();
        ExportFlags { rate, format, grid, pitch, unit }.options()
    }

    /// The first source, and what its content says that it is.
    pub(super) fn first_source(&self) -> Result<Option<SourceSpec>> {
        let options = self.export_options()?;
        self.sources.first().map(|text| source_of(text, None, &options)).transpose()
    }

    /// The export that is read, if it is one.
    pub(super) fn export(&self) -> Result<Option<VendorSource>> {
        let Some(SourceSpec::Vendor(path)) = self.first_source()? else { return Ok(None) };
        VendorSource::open(path, &self.export_options()?).map(Some)
    }

    /// The export whose body is used, which is so where none is named.
    pub(super) fn export_body(&self) -> Result<Option<(String, Vec<u8>)>> {
        let export = if self.body.is_none() { self.export()? } else { None };
        export.map(|export| Ok((export.body_name(), export.body()?))).transpose()
    }

    /// The calibration of the export that is read: where it comes from, and its text.
    pub(super) fn export_calibration(&self) -> Result<Option<(PathBuf, String)>> {
        let Some(export) = self.export()? else { return Ok(None) };
        // Of another body than its own it would be refused by name.
        let text = export.calibration().map(|text| match self.body {
            None => text,
            Some(_) => text.lines().filter(|line| !line.starts_with("body")).collect::<Vec<_>>().join("\n"),
        });
        Ok(text.map(|text| (export.path().to_owned(), text)))
    }
}
