//! What frames are read from.

use somatic::source::{CsvSource, Source, SourceSpec};
use somatic::{Error, Result, bundled};

use super::scene::Asked;

/// A source, or the bundled touch.
pub(super) struct Input {
    /// As messages call it.
    pub(super) name: String,
    /// `None` is the bundled touch.
    pub(super) spec: Option<SourceSpec>,
}

impl Input {
    /// What is read for `asked`, if anything is: a plan can be made without.
    pub(super) fn named_or_none(asked: &Asked) -> Result<Option<Self>> {
        let nothing = asked.sources.is_empty() && !matches!(asked.body.as_deref(), None | Some("hand"));
        if nothing { Ok(None) } else { Self::named(asked).map(Some) }
    }

    pub(super) fn named(asked: &Asked) -> Result<Self> {
        let Some(text) = asked.sources.first() else {
            return match asked.body.as_deref() {
                None | Some("hand") => Ok(Self { name: "bundled touch".to_owned(), spec: None }),
                Some(body) => Err(Error::usage(format!(
                    "body `{body}` needs a --source, such as csv:FILE or -; the bundled touch is for the bundled hand"
                ))),
            };
        };
        let spec: SourceSpec = text.parse()?;
        let name = match &spec {
            SourceSpec::Csv(path) | SourceSpec::Mcap(path) | SourceSpec::Sim(path) => path.display().to_string(),
            SourceSpec::Stdin => "stdin".to_owned(),
            _ => text.clone(),
        };
        let input = Self { name, spec: Some(spec) };
        if asked.speed.is_some() && !input.is_recording() {
            return Err(Error::usage("--speed is for recordings; live frames come when they come"));
        }
        Ok(input)
    }

    pub(super) fn is_bundled(&self) -> bool {
        self.spec.is_none()
    }

    pub(super) fn is_recording(&self) -> bool {
        !matches!(self.spec, Some(SourceSpec::Stdin | SourceSpec::Serial { .. }))
    }

    pub(super) fn open(&self, ids: &[u32], rate_hz: Option<f64>) -> Result<Box<dyn Source + Send>> {
        match &self.spec {
            Some(spec) => spec.open(ids, rate_hz),
            None => {
                let length = Some(bundled::TOUCH.len() as u64);
                Ok(Box::new(CsvSource::from_reader(&self.name, bundled::TOUCH, length, rate_hz)?))
            }
        }
    }
}
