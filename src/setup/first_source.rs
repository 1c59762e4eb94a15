//! The first source of a run: what its content says that it is, found out once.

use std::fmt;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use super::Tell;
use super::mapped::open_mapped;
use crate::error::{Error, Result};
use crate::source::{MappedSource, Source as _, SourceSpec, TextSource, VendorOptions, VendorSource};

/// The source `text` as one of `kinds`, and what its content says that it is.
pub fn source_of(text: &str, kinds: &[&str], options: &VendorOptions) -> Result<SourceSpec> {
    with_content(SourceSpec::one_of(text, kinds)?, options)
}

/// `source` as what its content says that it is.
fn with_content(source: SourceSpec, options: &VendorOptions) -> Result<SourceSpec> {
    let spec = source.with_content(options);
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

/// The first source of a run as it was found, so that an export's file is opened once for its sensors and its frames.
#[derive(Clone, Default)]
pub(super) struct FirstSource(Arc<Mutex<Option<Found>>>);

/// A source, and the export that it is.
pub(super) struct Found {
    /// What was asked for.
    asked: SourceSpec,
    options: VendorOptions,
    pub(super) spec: SourceSpec,
    export: Option<Export>,
    lines: Option<Text>,
    mapped: Option<Mapped>,
}

/// Lines of text that are listened to, and the body that is made for them.
pub(super) struct Text {
    pub(super) body: Result<Vec<u8>>,
    pub(super) about_body: String,
    /// Until it is read.
    pub(super) source: Option<Box<TextSource>>,
}

/// Arrays within messages, and the body that is made for them.
pub(super) struct Mapped {
    pub(super) body: Result<Vec<u8>>,
    pub(super) about_body: String,
    /// Until it is read.
    pub(super) source: Option<Box<MappedSource>>,
}

/// What an export says of itself, and its frames.
pub(super) struct Export {
    pub(super) body_name: String,
    pub(super) body: Result<Vec<u8>>,
    pub(super) calibration: Option<String>,
    pub(super) is_placed: bool,
    pub(super) path: PathBuf,
    /// Until it is read.
    pub(super) source: Option<Box<VendorSource>>,
}

impl FirstSource {
    /// What `look` sees of the source `asked`, which is found out once.
    pub(super) fn look<T>(
        &self,
        asked: &SourceSpec,
        options: VendorOptions,
        look: impl FnOnce(&mut Found) -> Result<T>,
    ) -> Result<T> {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = match known.take() {
            Some(found) if found.asked == *asked && found.options == options => found,
            _ => {
                let spec = with_content(asked.clone(), &options)?;
                Found { asked: asked.clone(), options, spec, export: None, lines: None, mapped: None }
            }
        };
        look(known.insert(found))
    }
}

impl fmt::Debug for FirstSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("FirstSource")
    }
}

impl Found {
    /// The source of lines of text, if this is one. `tell` gets their recognised format at once, before a table fills the
    /// terminal.
    pub(super) fn text(&mut self, tell: &Tell) -> Result<Option<&mut Text>> {
        if let (SourceSpec::Text(place), None) = (&self.spec, &self.lines) {
            self.spec.check_options(&self.options)?;
            let mut source = TextSource::open(place, &self.options, &mut |what| tell.say(what))?;
            source.notices().iter().for_each(|notice| tell.say(notice));
            let (body, about_body) = (source.body(), source.about_body());
            self.lines = Some(Text { body, about_body, source: Some(Box::new(source)) });
        }
        Ok(self.lines.as_mut())
    }

    /// The source whose messages hold arrays, if there is a map, and it is not lines that come live. `tell` gets what was taken
    /// for what.
    pub(super) fn mapped(&mut self, tell: &Tell) -> Result<Option<&mut Mapped>> {
        if self.options.map.is_some() && self.mapped.is_none() && !matches!(self.spec, SourceSpec::Text(_)) {
            let mut source = open_mapped(&self.spec, &self.options)?;
            source.take_notices().iter().for_each(|notice| tell.say(notice));
            let (body, about_body) = (source.body(), source.about_body());
            self.mapped = Some(Mapped { body, about_body, source: Some(Box::new(source)) });
        }
        Ok(self.mapped.as_mut())
    }

    /// The export, opened if it is one.
    pub(super) fn export(&mut self) -> Result<Option<&mut Export>> {
        if let (SourceSpec::Vendor(path), None) = (&self.spec, &self.export) {
            let source = VendorSource::open(path, &self.options)?;
            self.export = Some(Export {
                body_name: source.body_name(),
                body: source.body(),
                calibration: source.calibration(),
                is_placed: source.layout().is_placed(),
                path: path.clone(),
                source: Some(Box::new(source)),
            });
        }
        Ok(self.export.as_mut())
    }
}
