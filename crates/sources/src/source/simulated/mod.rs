//! Simulated touches: indenters move over a body's surface; the source delivers the sensors' frames and the truth.
//!
//! `docs/reference/simulation.md` has the file's keys and the model. The same file gives the same bytes on every machine.

mod calibration;
mod contact;
mod delivered;
mod disturbed;
mod drag;
mod file;
mod friction;
mod layer;
mod link_touch;
mod nearness;
mod noise;
mod patch;
mod path;
mod pressing;
mod profile;
mod quadrature;
mod radial;
mod record;
mod senses;
mod senses_setup;
mod sensor;
mod sensors;
mod setup;
#[cfg(test)]
mod tests;
mod truth;
mod whole;
mod whole_setup;
mod whole_truth;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use toml::Spanned;

pub use record::{write_recording, write_recording_with_progress};
pub use truth::Truth;
pub use whole::{GivenPress, GivenPresses, GivenTruth, NoisySensors};

use self::contact::Layer;
use self::delivered::Delivered;
use self::disturbed::{Disturbed, Wires};
use self::file::{File, SensorName};
use self::link_touch::{Felt, Kinds};
use self::pressing::{Touches, WrongTouch};
use self::senses::{Sensed, Senses};
use self::sensor::{Reading, Sensor};
use self::setup::Setup;
use self::whole::Covers;
use self::whole_truth::Moment;
use super::Source;
use crate::body::{Body, Modality, Taxel};
use crate::bundled;
use crate::error::{Error, ErrorKind, Result, failed};
use crate::field::{FieldSet, Lattice};
use crate::keys::Text;
use crate::limits::{self, MAX_TOML_BYTES};
use crate::signal::{Frame, RawValue, Sensors};

/// A source of frames of simulated touches.
pub struct SimulatedSource {
    name: String,
    body: Body,
    rate_hz: f64,
    frames: u64,
    layer: Layer,
    sensor: Sensor,
    disturbed: Disturbed,
    /// What the sensors cover.
    sensors: Sensors,
    /// Ids of the pressed taxels, and per taxel its index in the body and the side of a square of its area, m.
    ids: Vec<u32>,
    taxels: Vec<(usize, f64)>,
    senses: Senses,
    /// The channels of a frame, and what each delivers.
    channels: Vec<u32>,
    delivered: Vec<Delivered>,
    touches: Touches,
    notices: Vec<String>,
    next: u64,
    truth: Vec<Truth>,
    forces_newton: Vec<f64>,
    /// By pressed taxel along its tangents; empty where none has three axes.
    pulls_newton: Vec<[f64; 2]>,
    sensed: Sensed,
}

somatic_skin::debug_by_name!(SimulatedSource);

impl SimulatedSource {
    /// Opens the simulation in the TOML file at `path`.
    ///
    /// # Errors
    /// The file or its body cannot be read, or something in it makes no sense; the message has line and key.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = limits::read_to_string(path, MAX_TOML_BYTES).map_err(|e| Error::io(path, &e))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Self::from_text(&path.display().to_string(), &text, folder)
    }

    /// Whether the file at `path` has the keys of a simulation, and so is not a scene.
    #[must_use]
    pub fn is_named(path: impl AsRef<Path>) -> bool {
        let keys = limits::read_to_string(path, MAX_TOML_BYTES).ok().and_then(|text| text.parse::<toml::Table>().ok());
        keys.is_some_and(|keys| keys.contains_key("duration_s") || keys.contains_key("touch"))
    }

    /// The files that the simulation at `path` reads: itself and its body's files, as far as they can be found.
    #[must_use]
    pub fn files(path: impl AsRef<Path>) -> Vec<PathBuf> {
        let path = path.as_ref();
        let mut files = vec![path.to_owned()];
        let text = if path.is_file() {
            limits::read_to_string(path, MAX_TOML_BYTES).unwrap_or_default()
        } else {
            String::new()
        };
        if let Ok(File { body: Some(body), .. }) = Text(&text).parse() {
            files.extend(Body::files(path.parent().unwrap_or(Path::new("")).join(body.get_ref())));
        }
        files
    }

    /// The simulation in `text`, called `name` in messages, whose body is bundled or a file relative to `folder`.
    ///
    /// # Errors
    /// As [`SimulatedSource::open`].
    pub fn from_text(name: &str, text: &str, folder: &Path) -> Result<Self> {
        let text = Text(text);
        let opened = text.parse().and_then(|file| {
            let body = load_body(text, &file, folder)?;
            Self::new(name, text, &file, body, WrongTouch::Refuse)
        });
        opened.map_err(|e| e.at(name))
    }

    /// The simulation in `text`, called `name` in messages, on `body` instead of the body that the text names.
    ///
    /// # Errors
    /// As [`SimulatedSource::open`].
    pub fn on_body(name: &str, text: &str, body: Body) -> Result<Self> {
        let text = Text(text);
        text.parse().and_then(|file| Self::new(name, text, &file, body, WrongTouch::Refuse)).map_err(|e| e.at(name))
    }

    /// As [`SimulatedSource::on_body`], without the touches that the body's surface has no place for.
    ///
    /// # Errors
    /// As [`SimulatedSource::open`], but for those touches.
    pub fn on_body_where_possible(name: &str, text: &str, body: Body) -> Result<Self> {
        let text = Text(text);
        text.parse().and_then(|file| Self::new(name, text, &file, body, WrongTouch::LeaveOut)).map_err(|e| e.at(name))
    }

    fn new(name: &str, text: Text<'_>, file: &File, body: Body, wrong: WrongTouch) -> Result<Self> {
        let rate_hz = text.positive("rate_hz", &file.rate_hz)?;
        let duration_s = text.positive("duration_s", &file.duration_s)?;
        // 0.3 s at 10 Hz are three frames, although 0.3 · 10 is a little over 3.
        let frames = (duration_s * rate_hz - 1e-6).ceil().max(1.0);
        if frames > f64::from(u32::MAX) {
            let what = format!("`duration_s` and `rate_hz` make {frames:e} frames; that is too many");
            return Err(text.wrong(file.duration_s.span(), what));
        }
        let pressure = || body.taxels.iter().enumerate().filter(|(_, taxel)| taxel.modality.is_pressed());
        let ids: Vec<u32> = pressure().map(|(_, taxel)| taxel.id).collect();
        let (channels, delivered) = delivered::channels(&body);
        if channels.is_empty() {
            return Err(failed!("the body `{}` has no taxels of a kind that is simulated", body.name));
        }
        let has_pulls = body.taxels.iter().any(|taxel| taxel.modality == Modality::Force3);
        if let Some(kind) = file.sensor.kind.as_ref().filter(|kind| has_pulls && *kind.get_ref() == SensorName::Fsr) {
            let what = "`kind` is fsr, which feels only the normal force; taxels with three axes need ideal or linear";
            return Err(text.wrong(kind.span(), what));
        }
        let senses = Senses::new(text, &body, &file.temperature, &file.proximity)?;
        let area = file.sensor.area_m2.as_ref().map(|area| text.positive("area_m2", area)).transpose()?;
        let side = |taxel: &Taxel| match area.unwrap_or(taxel.area) {
            area if area > 0.0 => Ok(area.sqrt()),
            _ => Err(failed!("taxel {} has no area in the layout; give all one as [sensor] `area_m2`", taxel.id)),
        };
        let taxels = pressure().map(|(index, taxel)| Ok((index, side(taxel)?))).collect::<Result<Vec<_>>>()?;
        let fields = FieldSet::new(&body)?;
        let mut setup = Setup { text, body: &body, fields: &fields, surfaces: BTreeMap::new(), duration_s };
        let layer = setup.layer(file.layer.as_ref())?;
        let sensor = sensors::sensors(text, &file.sensor, &file.calibration, file.seed, &ids)?;
        let disturbed = disturbed(text, file, &fields, &taxels)?;
        let covers = whole_setup::covers(text, &file.sensor)?;
        let kinds = Kinds { pressed: &taxels, warm: &senses.warm, near: &senses.near, has_pulls };
        let touches = Touches::new(&mut setup, &file.touch, &layer, kinds, covers, wrong)?;
        let sensors = match &touches.body_skin {
            Some(_) if covers == Covers::Cell => Sensors::Cell,
            _ => size_of(&taxels),
        };
        Ok(Self {
            name: name.to_owned(),
            rate_hz,
            frames: frames as u64,
            layer,
            sensor,
            disturbed,
            sensors,
            forces_newton: vec![0.0; ids.len()],
            pulls_newton: if has_pulls { vec![[0.0; 2]; ids.len()] } else { Vec::new() },
            sensed: senses.untouched(),
            ids,
            senses,
            channels,
            delivered,
            taxels,
            touches,
            notices: senses_setup::without_effect(file, &body).into_iter().collect(),
            next: 0,
            truth: Vec::new(),
            body,
        })
    }

    /// The body that is touched.
    #[must_use]
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// Frames a second.
    #[must_use]
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Number of frames from beginning to end.
    #[must_use]
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// The truth of the last frame: one entry per touch that presses, in the file's order.
    #[must_use]
    pub fn truth(&self) -> &[Truth] {
        &self.truth
    }

    /// The force on each taxel of pressure or force in the frame read last, N, ascending by id, before any sensor: along its normal.
    #[must_use]
    pub fn forces_newton(&self) -> &[f64] {
        &self.forces_newton
    }

    /// The calibration of these sensors, as `docs/reference/calibration.md` describes such a file: what they read when untouched
    /// is 0, `ideal` and `linear` ones give newtons (`unit`), `fsr` ones the linear signal, and broken ones are masked. It knows the
    /// layer, and what the sensors cover.
    #[must_use]
    pub fn calibration(&self) -> String {
        let body = Path::new(&self.body.name).file_name().unwrap_or_default();
        let text = self.sensor.calibration(&body.to_string_lossy(), &self.ids, self.sensors);
        text + &delivered::shear_calibration(&self.sensor, &self.pulls_newton, self.touches.friction())
            + &self.senses.calibration()
            + &self.layer.calibration()
    }

    /// The temperature of each temperature taxel in the frame read last, °C, ascending by id, before its noise.
    #[must_use]
    pub fn celsius(&self) -> &[f64] {
        self.senses.celsius()
    }

    /// By how much the gain of each taxel differs from what the calibration says, in the order of
    /// [`SimulatedSource::forces_newton`]: the factors on their forces.
    #[must_use]
    pub fn gains(&self) -> &[f64] {
        &self.sensor.gains
    }

    /// Goes back to the first frame, with the noise of another seed.
    pub fn reseed(&mut self, seed: u64) {
        self.sensor.seed = seed;
        self.seek(0);
    }

    /// Makes `frame` (counted from 0) the one that is read next. Hysteresis, friction and temperatures know nothing of what was
    /// before it.
    pub fn seek(&mut self, frame: u64) {
        self.disturbed.rest();
        self.senses.rest();
        self.touches.rest();
        self.next = frame.min(self.frames);
    }

    fn time(&self, frame: u64) -> f64 {
        frame as f64 / self.rate_hz
    }

    /// Presses all touches in `frame`.
    fn press(&mut self, frame: u64) -> Result<()> {
        let before_s = frame.checked_sub(1).map(|frame| self.time(frame));
        let moment = Moment { touch: 0, frame, t_s: self.time(frame), before_s };
        let has_pulls = !self.pulls_newton.is_empty();
        let kinds = Kinds { pressed: &self.taxels, warm: &self.senses.warm, near: &self.senses.near, has_pulls };
        let (forces_newton, pulls_newton) = (&mut self.forces_newton, &mut self.pulls_newton);
        let mut felt = Felt { forces_newton, pulls_newton, sensed: &mut self.sensed };
        self.touches.press(&self.body, &self.layer, kinds, &moment, (&mut felt, &mut self.truth))
    }
}

impl Source for SimulatedSource {
    fn taxels(&self) -> &[u32] {
        &self.channels
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        if self.next >= self.frames {
            return Ok(false);
        }
        let number = self.next;
        self.next += 1;
        self.truth.clear();
        self.forces_newton.fill(0.0);
        self.pulls_newton.fill([0.0; 2]);
        self.sensed = self.senses.untouched();
        self.press(number).map_err(|e| e.at(&self.name))?;
        frame.clear();
        frame.t_s = self.time(number);
        frame.values.clear();
        self.senses.feel(frame.t_s, &self.sensed);
        let felt = self.disturbed.felt(&self.forces_newton);
        let (t_s, seed) = (frame.t_s, [self.sensor.seed, number]);
        let readings = self.channels.iter().zip(&self.delivered).map(|(&id, &delivered)| {
            let reading = |index: usize, force_newton: f64| Reading { index, id, frame: number, t_s, force_newton };
            RawValue::new(match delivered {
                Delivered::Force(index) => self.sensor.read(&reading(index, felt[index])),
                Delivered::Pull(index, axis) => self.sensor.read_pull(&reading(index, self.pulls_newton[index][axis])),
                Delivered::Temperature(index) => self.senses.warm_reading(index, id, seed),
                Delivered::Distance(index) => self.senses.near_reading(self.sensed.distances_m[index], id, seed),
            })
        });
        frame.values.extend(readings);
        Ok(true)
    }

    fn progress(&self) -> Option<f64> {
        Some(self.next as f64 / self.frames as f64)
    }

    fn notices(&mut self) -> Vec<String> {
        self.notices.drain(..).chain(self.touches.notices()).map(|what| format!("{}: {what}", self.name)).collect()
    }
}

/// What sensors of the file feel beside the force on them.
fn disturbed(text: Text<'_>, file: &File, fields: &FieldSet, taxels: &[(usize, f64)]) -> Result<Disturbed> {
    let share = |name: &str, key: Option<&Spanned<f64>>| {
        let Some(key) = key else { return Ok(0.0) };
        match text.not_negative(name, key)? {
            share if share < 1.0 => Ok(share),
            share => Err(text.wrong(key.span(), format!("`{name}` is {share}; it is a share, from 0 to under 1"))),
        }
    };
    let keys = &file.sensor;
    let (crosstalk, hysteresis) =
        (share("crosstalk", keys.crosstalk.as_ref())?, share("hysteresis", keys.hysteresis.as_ref())?);
    let wires = match &keys.crosstalk {
        Some(key) if crosstalk > 0.0 => {
            let indices: Vec<usize> = taxels.iter().map(|(taxel, _)| *taxel).collect();
            let wires = Wires::new(&Lattice::all(fields), &indices);
            Some(wires.ok_or_else(|| {
                text.wrong(
                    key.span(),
                    "`crosstalk` goes along rows and columns, and no field of this body has taxels in such".to_owned(),
                )
            })?)
        }
        _ => None,
    };
    Ok(Disturbed::new(taxels.len(), crosstalk, wires, hysteresis))
}

/// What sensors that feel squares with these sides cover: sides that are all one are of sensors of one size, others are those of cells.
fn size_of(taxels: &[(usize, f64)]) -> Sensors {
    /// Sides that differ by less than this share are one.
    const ALIKE: f64 = 0.01;
    let range = |(low, high): (f64, f64), &(_, side_m): &(usize, f64)| (low.min(side_m), high.max(side_m));
    let (low, high) = taxels.iter().fold((f64::INFINITY, 0.0), range);
    if high <= (1.0 + ALIKE) * low { Sensors::Equal } else { Sensors::Cell }
}

fn load_body(text: Text<'_>, file: &File, folder: &Path) -> Result<Body> {
    let Some(body) = &file.body else {
        return Err(text.wrong(0..0, "`body` is missing; give a file, or hand, sensing-hand, mat or humanoid"));
    };
    if let Some(bytes) = bundled::body(body.get_ref()) {
        return Body::from_bytes(body.get_ref(), bytes);
    }
    Body::load(folder.join(body.get_ref())).map_err(|e| {
        let is_path = Path::new(body.get_ref()).extension().is_some() || body.get_ref().contains('/');
        if e.kind() == ErrorKind::NotFound && is_path {
            let what =
                "no such file; `body` is a path from the simulation's folder, or hand, sensing-hand, mat or humanoid";
            text.wrong(body.span(), format!("{}: {what}", folder.join(body.get_ref()).display()))
        } else if e.kind() == ErrorKind::NotFound {
            text.unknown(body, "body", bundled::BODIES)
        } else {
            text.wrong(body.span(), e.to_string())
        }
    })
}
