//! Recordings that pressure systems export, as commands name them.

use std::path::PathBuf;

use clap::Args;
use somatic::Result;
use somatic::scene::file::SceneFile;
use somatic::source::{SourceSpec, TextSource, VendorFormat, VendorOptions, VendorSource};

use super::first_source::{Export, Found, Text};
use super::scene::{Asked, in_flags, one_of};
use super::stdio::say;

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

    /// Where the sensors of pedar's insoles are, which its files do not say: a CSV with the columns id, x, y and area, in
    /// metres and square metres.
    #[arg(long, value_name = "FILE.csv")]
    pub(super) layout: Option<PathBuf>,
}

impl ExportFlags {
    /// What a scene would say of it.
    pub(super) fn keys(&self) -> SceneFile {
        let Self { rate, format, grid, pitch, unit, layout } = self.clone();
        let mut keys = SceneFile::default();
        (keys.rate_hz, keys.format, keys.grid, keys.pitch) = (rate, format, grid, pitch);
        (keys.unit, keys.layout) = (unit, layout);
        keys
    }

    pub(super) fn options(&self) -> Result<VendorOptions> {
        self.keys().export_options().map_err(in_flags)
    }
}

impl Asked {
    /// What `look` sees of the lines of text that are listened to, if there are any.
    fn text<T>(&self, look: impl FnOnce(&mut Text) -> T) -> Result<Option<T>> {
        Ok(self.found(|found| Ok(found.text(self.quiet)?.map(look)))?.flatten())
    }

    /// The lines of text that are listened to, for a body whose taxels have `ids`, if there are any and they have not been taken
    /// before.
    pub(super) fn take_text(&self, ids: &[u32]) -> Result<Option<TextSource>> {
        let source = self.text(|text| text.source.take())?.flatten();
        source.map(|source| source.for_body(ids)).transpose()
    }

    /// The body that is made for lines of text, where none is named.
    pub(super) fn text_body(&self) -> Result<Option<(String, Vec<u8>)>> {
        let made = self.text(|text| (text.body.clone(), text.about_body.clone()))?;
        let Some((body, about)) = made.filter(|_| self.body.is_none()) else { return Ok(None) };
        if !self.quiet {
            say(&about);
        }
        Ok(Some(("text".to_owned(), body?)))
    }

    /// What `look` sees of the first source, which is found out once.
    fn found<T>(&self, look: impl FnOnce(&mut Found) -> Result<T>) -> Result<Option<T>> {
        let Some(source) = self.sources.first() else { return Ok(None) };
        let options = self.export_options().map_err(in_flags)?;
        self.first.look(source, options, look).map(Some)
    }

    /// What `look` sees of the export that is read, if it is one.
    fn export<T>(&self, look: impl FnOnce(&mut Export) -> T) -> Result<Option<T>> {
        Ok(self.found(|found| Ok(found.export()?.map(look)))?.flatten())
    }

    /// The first source, and what its content says that it is.
    pub(super) fn first_source(&self) -> Result<Option<SourceSpec>> {
        self.found(|found| Ok(found.spec.clone()))
    }

    /// The export that is read, from its first frame on, if it is one and has not been taken before.
    pub(super) fn take_export(&self) -> Result<Option<Box<VendorSource>>> {
        Ok(self.export(|export| export.source.take())?.flatten())
    }

    /// Whether the export that is read says where its sensors are; `None` where it is none.
    pub(super) fn export_is_placed(&self) -> Result<Option<bool>> {
        self.export(|export| export.is_placed)
    }

    /// The export whose body is used, which is so where none is named.
    pub(super) fn export_body(&self) -> Result<Option<(String, Vec<u8>)>> {
        if self.body.is_some() {
            return Ok(None);
        }
        self.export(|export| Ok((export.body_name.clone(), export.body.clone()?)))?.transpose()
    }

    /// The calibration of the export that is read: where it comes from, and its text.
    pub(super) fn export_calibration(&self) -> Result<Option<(PathBuf, String)>> {
        let known = self.export(|export| Some((export.path.clone(), export.calibration.clone()?)))?.flatten();
        // Of another body than its own it would be refused by name.
        Ok(known.map(|(path, text)| match self.body {
            None => (path, text),
            Some(_) => {
                let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with("body")).collect();
                (path, lines.join("\n"))
            }
        }))
    }
}
