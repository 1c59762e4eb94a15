//! Maps: which values of a message are sensors, and which taxels these are.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::super::bag_name::type_of;
use super::super::sizes::{USUAL_PITCH_M, grid_of, pitch_of};
use super::super::text::TextIds;
use super::super::time_column::{TimeUnit, unit_at_end, unit_in_head};
use super::axes::Axes;
use super::decoder::Decoder;
use super::path::ArrayPath;
use super::presets;
use crate::error::{Error, Result, failed, parse_toml, suggestion};
use crate::limits::{self, MAX_TOML_BYTES};
use crate::signal::RawValue;

/// Registers that a device gives at once.
const MAX_REGISTERS: u16 = 125;

/// A file of a map, as people write it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    message: Option<String>,
    r#type: Option<String>,
    values: OneOrMany,
    names: Option<String>,
    axes: Option<String>,
    ids: Option<String>,
    grid: Option<String>,
    pitch: Option<String>,
    #[serde(default)]
    missing: Vec<f64>,
    scale: Option<f64>,
    time: Option<String>,
    decoder: Option<String>,
    definition: Option<PathBuf>,
    #[serde(default)]
    registers: BTreeMap<String, [u16; 2]>,
    #[serde(default)]
    pads: Vec<PadKeys>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum OneOrMany {
    One(String),
    Many(Vec<String>),
}

impl Default for OneOrMany {
    fn default() -> Self {
        Self::Many(Vec::new())
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PadKeys {
    name: String,
    grid: String,
    pitch: Option<String>,
    #[serde(default)]
    at_mm: [f64; 2],
}

/// A sheet of sensors: rows and columns of values that follow each other.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::source) struct Pad {
    pub(in crate::source) name: String,
    pub(in crate::source) grid: [u32; 2],
    /// From one row, and from one column, to the next, m.
    pub(in crate::source) pitch_m: [f64; 2],
    /// Its middle in the plane that pads lie in, m.
    pub(in crate::source) at_m: [f64; 2],
}

impl Pad {
    pub(in crate::source) fn cells(&self) -> usize {
        self.grid[0] as usize * self.grid[1] as usize
    }
}

/// Where the time of a message is.
#[derive(Clone, Debug, PartialEq)]
pub enum MapTime {
    /// In its header's stamp, where it has one, or in a member called `t`, `time` or `timestamp`; else when it came.
    Usual,
    /// When it came.
    Arrival,
    /// A number or a stamp at this path; numbers are divided by the second value to get seconds.
    At(ArrayPath, f64),
}

/// Which values of a message are sensors, and which taxels these are: a file, or a preset by its name.
#[derive(Clone, Debug, PartialEq)]
pub struct ArrayMap {
    /// How it is called: a file or a preset.
    pub name: String,
    /// The topic of the messages, if it is named.
    pub message: Option<String>,
    /// The type of the messages in ROS 2's spelling, if it is named.
    pub kind: Option<String>,
    /// Where the values are; those of one path follow those of the one before.
    pub values: Vec<ArrayPath>,
    /// Where the sensors' names are, if they are read: one for each array at the path of values, or for each value.
    pub names: Option<ArrayPath>,
    /// The taxels of the values, in their order; of those with three axes, which have three values, once each.
    pub ids: Option<Vec<u32>>,
    /// Where the time is.
    pub time: MapTime,
    /// How numbers in text or bytes are written.
    pub decoder: Option<Decoder>,
    /// The definition of the messages, as a bag's schema `ros2msg` has it, where the map has one.
    pub definition: Option<String>,
    /// What people should know of a preset, a line each.
    pub notes: Vec<String>,
    /// Of taxels with three axes, which of their values is along which.
    pub(in crate::source) axes: Option<Axes>,
    /// Of a preset for bodies whose ids are the indices of a message's values, how these are along the axes of taxels that have three: all
    /// values along the first, then along the second, then along the third.
    pub(in crate::source) skin_axes: Option<Axes>,
    pub(in crate::source) pads: Vec<Pad>,
    pub(in crate::source) grid: Option<[u32; 2]>,
    pub(in crate::source) pitch_m: Option<[f64; 2]>,
    missing: Vec<f64>,
    scale: f64,
    /// Of devices that speak Modbus, the first register of an array and how many it has.
    registers: BTreeMap<String, [u16; 2]>,
}

impl ArrayMap {
    /// Whether `name` is a preset.
    #[must_use]
    pub fn is_preset(name: &str) -> bool {
        presets::find(name).is_some()
    }

    /// The map in the file `name`, or the preset of that name.
    ///
    /// # Errors
    /// A usage error: there is no such file or preset, or the file is not a map.
    pub fn named(name: &str) -> Result<Self> {
        if let Some(preset) = presets::find(name).filter(|_| !Path::new(name).is_file()) {
            let mut map = Self::parse(preset.map)?;
            map.notes = preset.notes.iter().map(|&note| note.to_owned()).collect();
            if preset.is_untested {
                map.notes.push("untested: nobody has run it on this hardware, so check each pad by a press".to_owned());
            }
            map.definition = preset.definition.map(str::to_owned);
            map.skin_axes = preset.skin_axes.map(str::parse).transpose()?;
            return Ok(Self { name: name.to_owned(), ..map });
        }
        let path = Path::new(name);
        if !path.exists() && path.extension().is_none() {
            let near = suggestion(name, presets::names());
            return Err(Error::usage(format!("`{name}` is neither a file nor a preset; {near}")));
        }
        let text = limits::read_to_string(path, MAX_TOML_BYTES).map_err(|e| Error::io(path, &e))?;
        let mut map = Self::parse(&text).map_err(|e| e.into_usage().at(path.display()))?;
        name.clone_into(&mut map.name);
        if let Some(file) = map.definition.take() {
            let file = path.parent().unwrap_or(Path::new("")).join(file);
            let text = limits::read_to_string(&file, MAX_TOML_BYTES).map_err(|e| Error::io(&file, &e))?;
            map.definition = Some(text);
        }
        Ok(map)
    }

    /// The map in `text`; `definition` is still the name of a file.
    ///
    /// # Errors
    /// It is not a map.
    pub fn parse(text: &str) -> Result<Self> {
        let mut keys: Keys = parse_toml(text)?;
        let at = |key: &'static str| move |e: Error| failed!("{key}: {e}");
        let values = match std::mem::take(&mut keys.values) {
            OneOrMany::One(path) => vec![path],
            OneOrMany::Many(paths) => paths,
        };
        let axes = axes_of(&keys, values.len()).map_err(at("axes"))?;
        if values.is_empty() {
            return Err(Error::failed("values: name the array of the values, such as data or pads[*].pressure"));
        }
        if keys.names.is_some() && (values.len() > 1 || !keys.pads.is_empty()) {
            return Err(Error::failed(
                "names: they go with one path of values, and make the pads; leave out the others",
            ));
        }
        let scale = keys.scale.unwrap_or(1.0);
        if !(scale.is_finite() && scale != 0.0) {
            return Err(failed!("scale: {scale} is not a factor; give a number other than 0"));
        }
        let ids = match keys.ids.as_deref().map(str::parse::<TextIds>).transpose().map_err(at("ids"))? {
            Some(TextIds::Names) => return Err(Error::failed("ids: list the taxels, such as 0-15")),
            Some(TextIds::Listed(ids)) => Some(ids),
            None => None,
        };
        for (name, [first, count]) in &keys.registers {
            if !(1..=MAX_REGISTERS).contains(count) || first.checked_add(count - 1).is_none() {
                return Err(failed!(
                    "registers: `{name}` has {count} from {first} on; a device gives 1 to {MAX_REGISTERS} at once, up to 65535"
                ));
            }
        }
        let whole = |kind: String| {
            type_of(&kind).ok_or_else(|| failed!("type: `{kind}` is not a type; write it as package/msg/Name"))
        };
        Ok(Self {
            name: "map".to_owned(),
            message: keys.message,
            kind: keys.r#type.map(whole).transpose()?,
            axes,
            skin_axes: None,
            values: values.iter().map(|path| path.parse()).collect::<Result<_>>().map_err(at("values"))?,
            names: keys.names.as_deref().map(str::parse).transpose().map_err(at("names"))?,
            ids,
            time: keys.time.map_or(Ok(MapTime::Usual), |time| time_of(&time)).map_err(at("time"))?,
            decoder: keys.decoder.as_deref().map(str::parse).transpose().map_err(at("decoder"))?,
            definition: keys.definition.map(|file| file.display().to_string()),
            notes: Vec::new(),
            pads: keys.pads.iter().map(pad).collect::<Result<_>>().map_err(at("pads"))?,
            grid: keys.grid.as_deref().map(grid).transpose().map_err(at("grid"))?,
            pitch_m: keys.pitch.as_deref().map(pitch).transpose().map_err(at("pitch"))?,
            missing: keys.missing,
            scale,
            registers: keys.registers,
        })
    }

    /// The value of a taxel for the number `number` of a message.
    #[must_use]
    pub fn value(&self, number: f64) -> RawValue {
        if self.missing.contains(&number) { RawValue::MISSING } else { RawValue::new(number * self.scale) }
    }

    /// The first register and the number of registers of each of its arrays.
    ///
    /// # Errors
    /// A usage error: it does not name them.
    pub(in crate::source) fn blocks(&self) -> Result<Vec<[u16; 2]>> {
        if self.registers.is_empty() {
            return Err(Error::usage(
                "registers: name them, as registers = { palm = [4900, 112] }, the first and how many",
            ));
        }
        let block = |path: &ArrayPath| {
            let name = path.to_string();
            let near = || suggestion(&name, self.registers.keys().map(String::as_str));
            let missing = || Error::usage(format!("registers: there is no `{name}`; {}", near()));
            self.registers.get(&name).copied().ok_or_else(missing)
        };
        self.values.iter().map(block).collect()
    }

    /// Pads by the names of sensors, each with so many values, one below the other.
    pub(in crate::source) fn pads_of(&self, named: &[(String, usize)]) -> Vec<Pad> {
        let mut used = BTreeSet::new();
        let mut down_m = 0.0;
        let pad = |(index, (name, count)): (usize, &(String, usize))| {
            let stem = if name.trim().is_empty() { format!("sensor_{index}") } else { name.trim().to_owned() };
            let others = (2..).map(|number| format!("{stem}_{number}"));
            let name = std::iter::once(stem.clone()).chain(others).find(|name| used.insert(name.clone()));
            let count = u32::try_from(*count).unwrap_or(u32::MAX);
            let grid =
                self.grid.filter(|[rows, columns]| rows.checked_mul(*columns) == Some(count)).unwrap_or([1, count]);
            let pitch_m = self.pitch_m.unwrap_or([USUAL_PITCH_M; 2]);
            let height_m = f64::from(grid[0]) * pitch_m[0];
            let at_m = [0.0, -(down_m + height_m / 2.0)];
            down_m += height_m + pitch_m[0];
            Pad { name: name.unwrap_or(stem), grid, pitch_m, at_m }
        };
        named.iter().enumerate().filter(|(_, (_, count))| *count > 0).map(pad).collect()
    }

    /// Its paths in words.
    #[must_use]
    pub fn paths(&self) -> String {
        match &self.values[..] {
            [first, .., last] => format!("{first} to {last}"),
            [one] => one.to_string(),
            [] => String::new(),
        }
    }

    /// What is done to numbers, in words that follow others.
    #[must_use]
    pub fn treatment(&self) -> String {
        let mut words = String::new();
        if !self.missing.is_empty() {
            let codes: Vec<String> = self.missing.iter().map(f64::to_string).collect();
            words += &format!("; {} counts as missing", codes.join(" or "));
        }
        if self.scale != 1.0 {
            words += &format!("; numbers are multiplied by {}", self.scale);
        }
        words
    }
}

fn time_of(text: &str) -> Result<MapTime> {
    if text == "arrival" {
        return Ok(MapTime::Arrival);
    }
    let (path, unit) = match text.rsplit_once(':').filter(|(_, unit)| !unit.contains(']')) {
        Some((path, unit)) => (path, Some(unit)),
        None => (text, None),
    };
    let path: ArrayPath = path.parse()?;
    let unit = match unit {
        None => {
            let name = path.last_field();
            unit_in_head(name).ok().flatten().flatten().or_else(|| unit_at_end(name)).unwrap_or(TimeUnit::Seconds)
        }
        Some("s") => TimeUnit::Seconds,
        Some("ms") => TimeUnit::Milliseconds,
        Some("us" | "µs") => TimeUnit::Microseconds,
        Some("ns") => TimeUnit::Nanoseconds,
        Some(other) => return Err(failed!("`{other}` is not a unit of time; write s, ms, us or ns")),
    };
    Ok(MapTime::At(path, unit.seconds()))
}

fn axes_of(keys: &Keys, paths: usize) -> Result<Option<Axes>> {
    let Some(axes) = &keys.axes else { return Ok(None) };
    let axes: Axes = axes.parse()?;
    if keys.names.is_some() {
        return Err(Error::failed("names of sensors are not read with it; leave out one of them"));
    }
    axes.check(paths, keys.pads.len())?;
    Ok(Some(axes))
}

fn grid(text: &str) -> Result<[u32; 2]> {
    grid_of(text).ok_or_else(|| failed!("`{text}` is not rows and columns; write them as 3x4"))
}

fn pitch(text: &str) -> Result<[f64; 2]> {
    pitch_of(text).ok_or_else(|| failed!("`{text}` is not a length; write it with its unit, as 4mm or 4mm,5mm"))
}

fn pad(keys: &PadKeys) -> Result<Pad> {
    let pitch = keys.pitch.as_deref().map(pitch).transpose()?;
    Ok(Pad {
        name: keys.name.clone(),
        grid: grid(&keys.grid)?,
        pitch_m: pitch.unwrap_or([USUAL_PITCH_M; 2]),
        at_m: keys.at_mm.map(|mm| mm * 1e-3),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_says_what_is_what() {
        let map = ArrayMap::parse(
            "message = '/dex3/left/state'\ntype = 'unitree_hg/HandState'\nvalues = 'press_sensor_state[*].pressure'\n\
             ids = '4-5'\nmissing = [30000]\nscale = 1e-4\ntime = 'stamp_ms'\ndecoder = 'i16le'\n",
        )
        .unwrap();
        assert_eq!(map.kind.as_deref(), Some("unitree_hg/msg/HandState"));
        assert_eq!((map.value(30000.0), map.value(100_000.0)), (RawValue::MISSING, RawValue::new(10.0)));
        assert_eq!(map.ids, Some(vec![4, 5]));
        assert_eq!(map.time, MapTime::At("stamp_ms".parse().unwrap(), 1e3));
        assert_eq!(map.treatment(), "; 30000 counts as missing; numbers are multiplied by 0.0001");
        let many = ArrayMap::parse("values = ['a', 'b[*].c', 'd']\ntime = 'a.t:us'").unwrap();
        assert_eq!((many.paths().as_str(), many.values.len()), ("a to d", 3));
        assert_eq!(many.time, MapTime::At("a.t".parse().unwrap(), 1e6));
    }

    #[test]
    fn a_map_that_is_wrong_says_where_in_a_line() {
        for (text, says) in [
            ("", "values"),
            ("values = []", "values: name the array"),
            ("values = 'a..b'", "values: `a..b` is not a path"),
            ("values = 'a'\nvalue = 'b'", "value"),
            ("values = 'a'\nids = 'x'", "ids: "),
            ("values = 'a'\nids = 'names'", "ids: list the taxels"),
            ("values = 'a'\ngrid = '3'", "grid: "),
            ("values = 'a'\nscale = 0", "scale: "),
            ("values = 'a'\ntype = 'x'", "type: `x` is not a type"),
            ("values = 'a'\ntime = 't:h'", "time: `h` is not a unit"),
            ("values = 'a'\naxes = 'xyz'", "axes: `xyz` does not name"),
            (
                "values = ['a', 'b']\naxes = 'u,v,n'",
                "axes: with commas each path of values has one axis, so that a pad needs three, and there are 2 paths",
            ),
            (
                "values = 'a'\naxes = 'u,v,n'",
                "axes: with commas each path of values has one axis, so that a pad needs three, and there is one",
            ),
            ("values = 'a'\ndecoder = 'x'", "decoder: `x` is not a decoder"),
            ("values = 'a'\n[[pads]]\nname = 'p'\ngrid = 'a'", "pads: "),
        ] {
            let why = ArrayMap::parse(text).unwrap_err().to_string();
            assert!(why.contains(says) && why.lines().count() == 1, "{text:?}: {why}");
            assert!(why.matches("axes: ").count() < 2, "{why}");
        }
        let why = ArrayMap::named("dex4").unwrap_err();
        assert!(why.is_usage() && why.to_string().contains("did you mean `dex3`?"), "{why}");
    }

    #[test]
    fn names_of_sensors_are_pads_one_below_the_other() {
        let map = ArrayMap::parse("values = 's[*].v'\nnames = 's[*].name'\ngrid = '2x2'\npitch = '5mm'").unwrap();
        let named = [("tip", 4), ("tip", 3), ("  ", 4), ("none", 0)].map(|(name, count)| (name.to_owned(), count));
        let pads = map.pads_of(&named);
        let names: Vec<(&str, [u32; 2])> = pads.iter().map(|pad| (pad.name.as_str(), pad.grid)).collect();
        assert_eq!(names, [("tip", [2, 2]), ("tip_2", [1, 3]), ("sensor_2", [2, 2])]);
        let downs: Vec<f64> = pads.iter().map(|pad| (pad.at_m[1] * 1e4).round() / 10.0).collect();
        assert_eq!(downs, [-5.0, -17.5, -30.0]);
        for (text, says) in [
            ("values = ['a', 'b']\nnames = 'c'", "names: they go with one path"),
            ("values = 'a'\nnames = 'c'\n[[pads]]\nname = 'p'\ngrid = '1x1'", "names: they go with one path"),
            ("values = 'a'\nnames = 'c..d'", "names: `c..d` is not a path"),
        ] {
            let why = ArrayMap::parse(text).unwrap_err().to_string();
            assert!(why.contains(says), "{why}");
        }
    }

    #[test]
    fn every_preset_is_a_map_with_notes() {
        for name in presets::names() {
            let map = ArrayMap::named(name).unwrap();
            assert_eq!(map.name, name);
            let values: usize = map.pads.iter().map(Pad::cells).sum();
            assert!(map.ids.as_ref().is_none_or(|ids| ids.len() == values), "{name}");
            assert!(map.notes.iter().all(|note| note.lines().count() == 1), "{name}");
        }
    }
}
