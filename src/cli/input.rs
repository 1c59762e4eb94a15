//! The input of a run.

use somatic::robot::BagSource;
use somatic::signal::Wiring;
use somatic::source::{
    CsvSource, Cut, Lines, NdjsonSource, Replay, SimulatedSource, Source, SourceSpec, VendorOptions,
};
use somatic::{Body, Error, Result, bundled};

use super::attached;
use super::bodies::{check_body_name, load_body};
use super::scene::{Asked, in_flags};
use super::stdio::check_input;

/// Frames a call for recordings, unless told otherwise.
pub(super) const RECORDED_BATCH: usize = 256;

/// A source, or the bundled touch.
pub(super) struct Input {
    /// As messages call it.
    pub(super) name: String,
    /// `None` is the bundled touch.
    pub(super) spec: Option<SourceSpec>,
    /// The serial lines with their baud rates, if given; empty for other sources.
    lines: Vec<(String, Option<u32>)>,
    /// The keys of limbs on other computers; empty for other sources.
    limbs: Vec<String>,
}

/// Boards on serial lines, or limbs on other computers.
pub(super) struct OpenedLines {
    pub(super) source: Box<dyn Source + Send>,
    pub(super) lines: Lines,
    /// Of boards.
    pub(super) wiring: Option<Wiring>,
}

impl Input {
    /// The input for `asked`, if any: a plan needs none.
    pub(super) fn named_or_none(asked: &Asked) -> Result<Option<Self>> {
        let nothing = asked.sources.is_empty() && !matches!(asked.body.as_deref(), None | Some("hand"));
        if nothing { Ok(None) } else { Self::named(asked).map(Some) }
    }

    pub(super) fn named(asked: &Asked) -> Result<Self> {
        let Some(named) = asked.sources.first() else {
            return match asked.body.as_deref() {
                None | Some("hand") => {
                    Ok(Self { name: "bundled touch".to_owned(), spec: None, lines: Vec::new(), limbs: Vec::new() })
                }
                Some(body) => {
                    check_body_name(body)?;
                    Err(Error::usage(format!(
                        "body `{body}` needs a --source, such as csv:FILE or -; the bundled touch is for the bundled hand"
                    )))
                }
            };
        };
        let Some(spec) = asked.first_source()? else { unreachable!("a source is named") };
        if spec.is_stdin() {
            check_input()?;
        }
        let name = match &spec {
            SourceSpec::Ros2Mcap(bag) => bag.to_string(),
            file if file.file().is_some() => file.file().map_or(String::new(), |path| path.display().to_string()),
            SourceSpec::Stdin | SourceSpec::CsvStdin => "stdin".to_owned(),
            SourceSpec::Text(place) => place.to_string(),
            SourceSpec::Ros2 { topic, .. } => format!("ros2:{topic}"),
            SourceSpec::Zenoh(_) if asked.sources.len() > 1 => format!("{} limbs", asked.sources.len()),
            _ if asked.sources.len() > 1 => format!("{} serial lines", asked.sources.len()),
            _ => named.to_string(),
        };
        let lines = asked.line_keys().lines(&asked.sources).map_err(in_flags)?;
        let key_of = |source: &SourceSpec| if let SourceSpec::Zenoh(key) = source { Some(key.clone()) } else { None };
        let limbs = asked.sources.iter().filter_map(key_of).collect();
        let input = Self { name, spec: Some(spec), lines, limbs };
        if input.spec == Some(SourceSpec::CsvStdin) {
            return match asked.repeat {
                Some(_) => Err(Error::usage("--loop is for recordings in files; standard input cannot be read twice")),
                None => Ok(input),
            };
        }
        if asked.playback_speed.is_some() && !input.is_recording() {
            return Err(Error::usage("--speed is for recordings; live frames come when they come"));
        }
        if (asked.from_s.is_some() || asked.to_s.is_some() || asked.repeat.is_some()) && !input.is_recording() {
            return Err(Error::usage("--from, --to and --loop are for recordings; live frames come when they come"));
        }
        Ok(input)
    }

    /// The body that `asked` names, or that of the input.
    pub(super) fn body(&self, asked: &Asked) -> Result<Body> {
        match (&asked.body, &self.spec) {
            (Some(body), _) => load_body(body),
            (None, Some(SourceSpec::Sim(path))) => Ok(SimulatedSource::open(path)?.body().clone()),
            (None, Some(SourceSpec::Mcap(path))) => match attached::body(path)? {
                Some((name, bytes)) => Body::from_bytes(&name, &bytes),
                None => load_body("hand"),
            },
            (None, Some(SourceSpec::Vendor(_))) => match asked.export_body()? {
                Some((name, bytes)) => Body::from_bytes(&name, &bytes),
                None => load_body("hand"),
            },
            (None, Some(SourceSpec::Text(_))) => match asked.text_body()? {
                Some((name, bytes)) => Body::from_bytes(&name, &bytes),
                None => load_body("hand"),
            },
            (None, _) => load_body("hand"),
        }
    }

    pub(super) fn is_bundled(&self) -> bool {
        self.spec.is_none()
    }

    /// Whether its frames may hold any taxel of the body, as no header names them.
    pub(super) fn holds_any(&self) -> bool {
        matches!(
            self.spec,
            Some(SourceSpec::Stdin | SourceSpec::Ros2 { .. } | SourceSpec::Ros2Mcap(_) | SourceSpec::Zenoh(_))
        )
    }

    pub(super) fn is_recording(&self) -> bool {
        use SourceSpec::{CsvStdin, Ros2, Serial, Stdin, Text, Zenoh};
        !matches!(self.spec, Some(Stdin | CsvStdin | Text(_) | Serial { .. } | Ros2 { .. } | Zenoh(_)))
    }

    /// Whether several boards or limbs are merged.
    pub(super) fn is_merged(&self) -> bool {
        !(self.lines.is_empty() && self.limbs.is_empty())
    }

    pub(super) fn is_stdin(&self) -> bool {
        self.spec.as_ref().is_some_and(|spec| spec.is_stdin() && *spec != SourceSpec::CsvStdin)
    }

    /// Identifies the recording: path, topic, length and modification time. `None` for live input.
    pub(super) fn recording(&self) -> Option<String> {
        let Some(spec) = &self.spec else { return Some(self.name.clone()) };
        let path = spec.file()?;
        let place = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let file = std::fs::metadata(path).ok();
        // A bag has several topics.
        let topic = if let SourceSpec::Ros2Mcap(bag) = spec { bag.to_string() } else { String::new() };
        Some(format!(
            "{place:?}{topic} {:?} {:?}",
            file.as_ref().map(std::fs::Metadata::len),
            file.as_ref().map(|f| f.modified().ok())
        ))
    }

    /// Opens the boards or limbs that are merged.
    pub(super) fn open_lines(&self, ids: &[u32], asked: &Asked) -> Result<OpenedLines> {
        #[cfg(feature = "zenoh")]
        if !self.limbs.is_empty() {
            let options = somatic::source::LimbOptions {
                zenoh_config: asked.zenoh_config.clone(),
                live_rate_hz: asked.live_rate_hz,
                max_age_s: asked.max_age_s,
            };
            let source = somatic::source::LimbSource::open(&self.limbs, ids, &options)?;
            return Ok(OpenedLines { lines: source.lines(), wiring: None, source: Box::new(source) });
        }
        if let Some(key) = self.limbs.first() {
            SourceSpec::Zenoh(key.clone()).open(ids, &VendorOptions::default())?;
        }
        let source = asked.line_keys().open(&self.lines, ids, asked.max_age_s)?;
        let (lines, wiring) = (source.lines(), Some(source.wiring().clone()));
        Ok(OpenedLines { source: Box::new(source), lines, wiring })
    }

    /// Opens it, or the requested part, for `body`, with poses of its links where joints are asked for.
    pub(super) fn open_posed(&self, body: &Body, asked: &Asked) -> Result<Box<dyn Source + Send>> {
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        asked.jointed(self.open(&ids, asked)?, body)
    }

    /// Opens it, or the requested part, for a body whose taxels have `ids`.
    pub(super) fn open(&self, ids: &[u32], asked: &Asked) -> Result<Box<dyn Source + Send>> {
        #[cfg(feature = "ros2")]
        if let Some(SourceSpec::Ros2 { topic, kind }) = &self.spec {
            return Ok(Box::new(somatic::robot::Ros2Source::open(topic, kind.as_deref(), &self.body(asked)?)?));
        }
        if let Some(source) = asked.take_text(ids)? {
            return Ok(Box::new(source));
        }
        let cut = Cut {
            from_s: asked.from_s.unwrap_or(Cut::WHOLE.from_s),
            to_s: asked.to_s.unwrap_or(Cut::WHOLE.to_s),
            times: asked.repeat.unwrap_or(Cut::WHOLE.times),
        };
        let (spec, name, ids, rate_hz) = (self.spec.clone(), self.name.clone(), ids.to_vec(), asked.rate_hz);
        let options = asked.export_options().map_err(in_flags)?;
        let strict = asked.strict;
        let of_bag = matches!(spec, Some(SourceSpec::Ros2Mcap(_))).then(|| self.body(asked)).transpose()?;
        // It was opened for its sensors; what comes after its first frame is still to be read.
        let mut opened = asked.take_export()?;
        let mut open = move || -> Result<Box<dyn Source + Send>> {
            if let Some(source) = opened.take() {
                return Ok(source);
            }
            if let (Some(spec @ SourceSpec::Ros2Mcap(bag)), Some(body)) = (&spec, &of_bag) {
                spec.check_options(&options)?;
                return Ok(Box::new(BagSource::open(bag, body)?));
            }
            match &spec {
                Some(SourceSpec::Stdin) if strict && rate_hz.is_none() => {
                    Ok(Box::new(NdjsonSource::stdin(ids.clone()).strict()))
                }
                Some(spec) => spec.open(&ids, &options),
                None => {
                    let length = Some(bundled::TOUCH.len() as u64);
                    Ok(Box::new(CsvSource::from_reader(&name, bundled::TOUCH, length, rate_hz)?))
                }
            }
        };
        if cut == Cut::WHOLE { open() } else { Ok(Box::new(Replay::new(open, cut)?)) }
    }
}
