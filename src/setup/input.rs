//! The input of a run: boards, limbs, a recording, or the bundled touch.

use super::Setup;
use super::attached;
use super::bodies::{check_body_name, load_body};
use super::mapped::open_mapped;
use crate::body::Body;
use crate::bundled;
use crate::error::{Error, Result};
use crate::robot::BagSource;
use crate::signal::{Channel, Wiring};
use crate::source::{
    CsvSource, Cut, Lines, NdjsonSource, Replay, SimulatedSource, Source, SourceSpec, TextOptions, VendorOptions,
};

/// Frames a call for recordings, by default.
pub const RECORDED_BATCH: usize = 256;

/// A source, or the bundled touch.
pub struct Input {
    /// As messages call it.
    pub name: String,
    /// `None` is the bundled touch.
    pub spec: Option<SourceSpec>,
    /// The serial lines with their baud rates, if given; empty for other sources.
    lines: Vec<(String, Option<u32>)>,
    /// The keys of limbs on other computers; empty for other sources.
    limbs: Vec<String>,
}

/// Boards on serial lines, or limbs on other computers.
pub struct OpenedLines {
    pub source: Box<dyn Source + Send>,
    pub lines: Lines,
    /// Of boards.
    pub wiring: Option<Wiring>,
}

impl Input {
    /// The input for `setup`, if any: a plan needs none.
    pub fn named_or_none(setup: &Setup) -> Result<Option<Self>> {
        let nothing = setup.sources.is_empty() && bundled_touch(setup).is_none();
        if nothing { Ok(None) } else { Self::named(setup).map(Some) }
    }

    pub fn named(setup: &Setup) -> Result<Self> {
        let Some(named) = setup.sources.first() else {
            return match setup.body.as_deref() {
                Some(body) if bundled_touch(setup).is_none() => {
                    check_body_name(body)?;
                    Err(Error::usage(format!(
                        "body `{body}` needs a `source`, such as csv:FILE or -; the bundled touches are for the bundled hands"
                    )))
                }
                _ => Ok(Self { name: "bundled touch".to_owned(), spec: None, lines: Vec::new(), limbs: Vec::new() }),
            };
        };
        if setup.sources.len() > 1 && named.is_recording() {
            return Err(Error::usage(
                "several recordings are run one after the other by `somatic run` alone, into a table; name one of them here",
            ));
        }
        let Some(spec) = setup.first_source()? else { unreachable!("a source is named") };
        let name = match &spec {
            SourceSpec::Ros2Mcap(bag) => bag.to_string(),
            SourceSpec::LeRobot(dataset) => dataset.to_string(),
            file if file.file().is_some() => file.file().map_or(String::new(), |path| path.display().to_string()),
            SourceSpec::Stdin | SourceSpec::CsvStdin => "stdin".to_owned(),
            SourceSpec::Text(place) => place.to_string(),
            SourceSpec::Ros2 { topic, .. } => format!("ros2:{topic}"),
            SourceSpec::Zenoh(_) if setup.sources.len() > 1 => format!("{} limbs", setup.sources.len()),
            _ if setup.sources.len() > 1 => format!("{} serial lines", setup.sources.len()),
            _ => named.to_string(),
        };
        let lines = setup.line_keys().lines(&setup.sources)?;
        let key_of = |source: &SourceSpec| if let SourceSpec::Zenoh(key) = source { Some(key.clone()) } else { None };
        let limbs = setup.sources.iter().filter_map(key_of).collect();
        let input = Self { name, spec: Some(spec), lines, limbs };
        if input.spec == Some(SourceSpec::CsvStdin) {
            return match setup.repeat {
                Some(_) => Err(Error::usage("`loop` is for recordings in files; standard input cannot be read twice")),
                None => Ok(input),
            };
        }
        if setup.playback_speed.is_some() && !input.is_recording() {
            return Err(Error::usage("`playback_speed` is for recordings; leave it out for live sources"));
        }
        if (setup.from_s.is_some() || setup.to_s.is_some() || setup.repeat.is_some()) && !input.is_recording() {
            return Err(Error::usage(
                "`from_s`, `to_s` and `loop` are for recordings; leave them out for live sources",
            ));
        }
        Ok(input)
    }

    /// The body that `setup` names, or that of the input.
    pub fn body(&self, setup: &Setup) -> Result<Body> {
        match (&setup.body, &self.spec) {
            (Some(body), _) => load_body(body),
            (None, Some(SourceSpec::Sim(path))) => Ok(SimulatedSource::open(path)?.body().clone()),
            (None, Some(SourceSpec::Mcap(path))) => match attached::body(path)? {
                Some((name, bytes)) => Body::from_bytes(&name, &bytes),
                None => load_body("hand"),
            },
            (None, Some(SourceSpec::Vendor(_))) => match setup.export_body()? {
                Some((name, bytes)) => Body::from_bytes(&name, &bytes),
                None => load_body("hand"),
            },
            (None, Some(SourceSpec::Text(_))) => match setup.text_body()? {
                Some((name, bytes)) => Body::from_bytes(&name, &bytes),
                None => load_body("hand"),
            },
            (None, _) => match setup.mapped_body()? {
                Some((name, bytes)) => Body::from_bytes(&name, &bytes),
                None => load_body("hand"),
            },
        }
    }

    pub fn is_bundled(&self) -> bool {
        self.spec.is_none()
    }

    /// Whether its frames may hold any taxel of the body, as no header names them.
    pub fn holds_any(&self) -> bool {
        matches!(
            self.spec,
            Some(
                SourceSpec::Stdin
                    | SourceSpec::Ndjson(_)
                    | SourceSpec::Ros2 { .. }
                    | SourceSpec::Ros2Mcap(_)
                    | SourceSpec::Zenoh(_)
            )
        )
    }

    pub fn is_recording(&self) -> bool {
        self.spec.as_ref().is_none_or(SourceSpec::is_recording)
    }

    /// Whether several boards or limbs are merged.
    pub fn is_merged(&self) -> bool {
        !(self.lines.is_empty() && self.limbs.is_empty())
    }

    pub fn is_stdin(&self) -> bool {
        self.spec.as_ref().is_some_and(|spec| spec.is_stdin() && *spec != SourceSpec::CsvStdin)
    }

    /// Identifies the recording: path, topic, length and modification time. `None` for live input.
    pub fn recording(&self) -> Option<String> {
        let Some(spec) = &self.spec else { return Some(self.name.clone()) };
        let path = spec.file()?;
        let place = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let file = std::fs::metadata(path).ok();
        // A bag has several topics, a dataset several episodes.
        let topic = match spec {
            SourceSpec::Ros2Mcap(_) | SourceSpec::LeRobot(_) => spec.to_string(),
            _ => String::new(),
        };
        Some(format!(
            "{place:?}{topic} {:?} {:?}",
            file.as_ref().map(std::fs::Metadata::len),
            file.as_ref().map(|f| f.modified().ok())
        ))
    }

    /// Opens the boards or limbs that are merged.
    pub fn open_lines(&self, ids: &[u32], setup: &Setup) -> Result<OpenedLines> {
        #[cfg(feature = "zenoh")]
        if !self.limbs.is_empty() {
            let options = crate::source::LimbOptions {
                zenoh_config: setup.zenoh_config.clone(),
                live_rate_hz: setup.live_rate_hz,
                max_age_s: setup.max_age_s,
            };
            let source = crate::source::LimbSource::open(&self.limbs, ids, &options)?;
            return Ok(OpenedLines { lines: source.lines(), wiring: None, source: Box::new(source) });
        }
        if let Some(key) = self.limbs.first() {
            SourceSpec::Zenoh(key.clone()).open(ids, &VendorOptions::default())?;
        }
        let source = setup.line_keys().open(&self.lines, ids, setup.max_age_s)?;
        let (lines, wiring) = (source.lines(), Some(source.wiring().clone()));
        Ok(OpenedLines { source: Box::new(source), lines, wiring })
    }

    /// Opens it, or the requested part, for `body`, with poses of its links where joints are asked for.
    pub fn open_posed(&self, body: &Body, setup: &Setup) -> Result<Box<dyn Source + Send>> {
        setup.jointed(self.open(&Channel::all_of(body), setup)?, body)
    }

    /// Opens it, or the requested part, for a body whose taxels have `ids`.
    pub fn open(&self, ids: &[u32], setup: &Setup) -> Result<Box<dyn Source + Send>> {
        #[cfg(feature = "ros2")]
        if let (Some(SourceSpec::Ros2 { topic, kind }), None) = (&self.spec, &setup.map) {
            return Ok(Box::new(crate::robot::Ros2Source::open(topic, kind.as_deref(), &self.body(setup)?)?));
        }
        if let Some(source) = setup.take_text(ids)? {
            return Ok(Box::new(source));
        }
        let cut = Cut {
            from_s: setup.from_s.unwrap_or(Cut::WHOLE.from_s),
            to_s: setup.to_s.unwrap_or(Cut::WHOLE.to_s),
            times: setup.repeat.unwrap_or(Cut::WHOLE.times),
        };
        let (spec, name, ids, rate_hz) = (self.spec.clone(), self.name.clone(), ids.to_vec(), setup.rate_hz);
        let touch = bundled_touch(setup).unwrap_or(bundled::TOUCH);
        let options = setup.export_options()?;
        let strict = setup.strict;
        let is_plain = options.map.is_none();
        let of_bag =
            (is_plain && matches!(spec, Some(SourceSpec::Ros2Mcap(_)))).then(|| self.body(setup)).transpose()?;
        // It was opened for its sensors; what comes after its first frame is still to be read.
        let mut opened = setup.take_export()?;
        let mut mapped = setup.take_mapped()?;
        let mut open = move || -> Result<Box<dyn Source + Send>> {
            if let Some(source) = opened.take() {
                return Ok(source);
            }
            if let (Some(spec), false) = (&spec, is_plain) {
                return Ok(Box::new(match mapped.take() {
                    Some(source) => source.for_body(&ids)?,
                    None => {
                        let mut again = open_mapped(spec, &options)?.for_body(&ids)?;
                        // They were said before.
                        again.take_notices();
                        again
                    }
                }));
            }
            if let (Some(spec @ SourceSpec::Ros2Mcap(bag)), Some(body)) = (&spec, &of_bag) {
                spec.check_options(&options)?;
                return Ok(Box::new(BagSource::open(bag, body)?.skip_bad(options.skip_bad)));
            }
            match &spec {
                Some(SourceSpec::Stdin) if strict && rate_hz.is_none() => {
                    Ok(Box::new(NdjsonSource::stdin(ids.clone()).strict().skip_bad(options.skip_bad)))
                }
                Some(spec) => spec.open(&ids, &options),
                None => {
                    // It is a table like any other.
                    SourceSpec::CsvStdin.check_options(&options)?;
                    if options.text != TextOptions::default() {
                        // Its columns are known.
                        SourceSpec::Stdin.check_options(&options)?;
                    }
                    let length = Some(touch.len() as u64);
                    Ok(Box::new(CsvSource::from_reader(&name, touch, length, rate_hz)?))
                }
            }
        };
        if cut == Cut::WHOLE { open() } else { Ok(Box::new(Replay::new(open, cut)?)) }
    }
}

/// The touch that comes with the bundled body that `setup` names, or with the hand if it names none.
fn bundled_touch(setup: &Setup) -> Option<&'static [u8]> {
    match setup.body.as_deref() {
        None | Some("hand") => Some(bundled::TOUCH),
        Some("sensing-hand") => Some(bundled::MEETING),
        Some(_) => None,
    }
}
