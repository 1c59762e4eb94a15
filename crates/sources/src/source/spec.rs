//! Parses the names of sources.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::bag_name::BagName;
use super::lerobot_name::LeRobotName;
use super::map::modbus::{self, ModbusRegisters};
use super::map::{ArrayMap, JsonLines, MappedSource, Messages};
use super::refused;
use super::{CsvSource, NdjsonSource, SimulatedSource, Source, TextPlace, TextSource, VendorOptions, VendorSource};
use crate::error::{Error, Result, nearest};

/// The syntax of each kind of source.
const FORMS: [(&str, &str); 15] = [
    ("csv", "csv:FILE"),
    ("ndjson", "ndjson:FILE"),
    ("serial", "serial:PORT[@BAUD]"),
    ("text", "text:PORT[@BAUD] (or text:tcp://HOST:PORT, text:udp://:PORT, text:-) for lines of numbers"),
    ("ros2", "ros2:/TOPIC[@TYPE]"),
    ("modbus", "modbus://HOST[:PORT][/UNIT]"),
    ("paxini", "paxini:PORT[@BAUD]"),
    ("zenoh", "zenoh:KEY"),
    ("mcap", "mcap:FILE"),
    ("ros2-mcap", "ros2-mcap:PATH[:/TOPIC,...][@TYPE]"),
    ("lerobot", "lerobot:DIR[:FEATURE][#EPISODE]"),
    ("export", "a pressure system's .csv, .asf, .lst, .asc or .txt"),
    ("sim", "sim:FILE.toml"),
    ("-", "- for NDJSON on standard input"),
    ("csv:-", "csv:- for CSV on standard input"),
];

/// Endings of pressure systems' exports; `.csv` is one of many things.
const EXPORTS: [&str; 5] = ["asf", "lst", "asc", "txt", "tsv"];

/// A source as named on a command line or in a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SourceSpec {
    /// `csv:FILE`, or a bare `FILE.csv`: a recording.
    Csv(PathBuf),
    /// `ndjson:FILE`, or a bare `FILE.ndjson` or `FILE.jsonl`: a recording in lines of JSON.
    Ndjson(PathBuf),
    /// `serial:PORT[@BAUD]`: a board on a serial line.
    Serial {
        /// The port's name, such as `/dev/ttyUSB0`.
        port: String,
        /// Its speed, where one is given.
        baud: Option<u32>,
    },
    /// `text:PORT[@BAUD]`, `text:tcp://HOST:PORT`, `text:udp://:PORT` or `text:-`: lines of text.
    Text(TextPlace),
    /// `ros2:/TOPIC[@TYPE]`: a topic of ROS 2.
    Ros2 {
        /// Its name, from `/` on.
        topic: String,
        /// The type of its messages, where one is given, such as `sensor_msgs/msg/PointCloud2`.
        kind: Option<String>,
    },
    /// `modbus://HOST[:PORT][/UNIT]`: registers of a device that speaks Modbus TCP, by a map.
    Modbus(String),
    /// `paxini:PORT[@BAUD]`: tactile sensors of PaXini on their board, on a serial line.
    Paxini {
        /// The port's name, such as `/dev/ttyUSB0`.
        port: String,
        /// Its speed, where one is given.
        baud: Option<u32>,
    },
    /// `zenoh:KEY`: a limb on another computer.
    Zenoh(String),
    /// `mcap:FILE`, or a bare `FILE.mcap`: a recording in MCAP.
    Mcap(PathBuf),
    /// `ros2-mcap:PATH[:/TOPIC,...][@TYPE]`: topics of a bag of ROS 2.
    Ros2Mcap(BagName),
    /// `lerobot:DIR[:FEATURE][#EPISODE]`: episodes of a LeRobot dataset.
    LeRobot(LeRobotName),
    /// A bare `FILE.lst`, `.asf`, `.asc` or `.txt`, or any file with content or a format that says so: a pressure system's
    /// export.
    Vendor(PathBuf),
    /// `sim:FILE.toml`: simulated touches.
    Sim(PathBuf),
    /// `-`: NDJSON frames on standard input.
    Stdin,
    /// `csv:-`: CSV on standard input.
    CsvStdin,
}

impl FromStr for SourceSpec {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Self::one_of(text, &FORMS.map(|(kind, _)| kind)).map_err(|e| e.at(format!("source `{text}`")))
    }
}

/// As it is named, the kind first where there is one.
impl fmt::Display for SourceSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Csv(path) => write!(f, "csv:{}", path.display()),
            Self::Ndjson(path) => write!(f, "ndjson:{}", path.display()),
            Self::Serial { port, baud: None } => write!(f, "serial:{port}"),
            Self::Serial { port, baud: Some(baud) } => write!(f, "serial:{port}@{baud}"),
            Self::Text(place) => place.fmt(f),
            Self::Ros2 { topic, kind: None } => write!(f, "ros2:{topic}"),
            Self::Ros2 { topic, kind: Some(kind) } => write!(f, "ros2:{topic}@{kind}"),
            Self::Modbus(place) => write!(f, "modbus://{place}"),
            Self::Paxini { port, baud: None } => write!(f, "paxini:{port}"),
            Self::Paxini { port, baud: Some(baud) } => write!(f, "paxini:{port}@{baud}"),
            Self::Zenoh(key) => write!(f, "zenoh:{key}"),
            Self::Mcap(path) => write!(f, "mcap:{}", path.display()),
            Self::Ros2Mcap(bag) => write!(f, "ros2-mcap:{bag}"),
            Self::LeRobot(name) => write!(f, "lerobot:{name}"),
            Self::Vendor(path) => write!(f, "{}", path.display()),
            Self::Sim(path) => write!(f, "sim:{}", path.display()),
            Self::Stdin => f.write_str("-"),
            Self::CsvStdin => f.write_str("csv:-"),
        }
    }
}

/// Whether `text` is the bare name of a serial port, as Linux, macOS or Windows have them.
fn is_port(text: &str) -> bool {
    let is_com = |rest: &str| rest.starts_with(|c: char| c.is_ascii_digit()) && !rest.contains('.');
    ["/dev/tty", "/dev/serial/", "/dev/cu.", "/dev/pts/"].iter().any(|start| text.starts_with(start))
        || text.strip_prefix("COM").is_some_and(is_com)
}

/// A topic of ROS 2, live: `/TOPIC[@TYPE]`.
fn topic(text: &str) -> Result<SourceSpec> {
    let (topic, kind) = text.split_once('@').map_or((text, None), |(topic, kind)| (topic, Some(kind)));
    if !topic.starts_with('/') || kind.is_some_and(str::is_empty) {
        return Err(Error::usage(format!(
            "`{text}` is not a topic; write ros2:/TOPIC, or ros2:/TOPIC@sensor_msgs/msg/PointCloud2"
        )));
    }
    // As ROS 1 and people write types.
    let whole = |kind: &str| super::bag_name::type_of(kind).unwrap_or_else(|| kind.to_owned());
    Ok(SourceSpec::Ros2 { topic: topic.to_owned(), kind: kind.map(whole) })
}

/// A serial line of the source `kind`: `PORT[@BAUD]`.
fn port(kind: &str, text: &str) -> Result<(String, Option<u32>)> {
    let Some((port, baud)) = text.rsplit_once('@') else { return Ok((text.to_owned(), None)) };
    match baud.parse() {
        Ok(baud) if baud > 0 && !port.is_empty() => Ok((port.to_owned(), Some(baud))),
        _ => Err(Error::usage(format!("`{baud}` is not a baud rate; write {kind}:PORT@115200"))),
    }
}

impl SourceSpec {
    /// Parses a source of one of `kinds`: `csv`, `serial`, `text`, `ros2`, `modbus`, `paxini`, `zenoh`, `mcap`, `ros2-mcap`, `lerobot`,
    /// `export`, `sim`, `-` and `csv:-`.
    ///
    /// # Errors
    /// A usage error that lists the syntax of these kinds.
    pub fn one_of(text: &str, kinds: &[&str]) -> Result<Self> {
        let forms: Vec<&str> = FORMS.iter().filter(|(kind, _)| kinds.contains(kind)).map(|(_, form)| *form).collect();
        let forms = match &forms[..] {
            [first @ .., last] if !first.is_empty() => format!("{} or {last}", first.join(", ")),
            forms => forms.concat(),
        };
        let bad = |what: String| Err(Error::usage(what));
        let is_read = kinds.contains(&"export");
        // Text is read compressed, too.
        let is_packed = Path::new(text).extension().is_some_and(|own| own.eq_ignore_ascii_case("gz"));
        let whole = if is_packed && is_read { Path::new(text).with_extension("") } else { text.into() };
        let ending = |wanted: &str| whole.extension().is_some_and(|own| own.eq_ignore_ascii_case(wanted));
        if kinds.contains(&"serial") && is_port(text) {
            return bad(format!(
                "`{text}` is a serial port; write text:{text} if its board prints numbers, or serial:{text} if it speaks somatic's protocol"
            ));
        }
        let known = refused::what_to_do(text).filter(|_| is_read);
        let (kind, rest) = match text.split_once(':') {
            Some(("csv", "-")) => ("csv:-", text),
            Some((kind, rest)) if !["-", "export"].contains(&kind) && FORMS.iter().any(|(known, _)| *known == kind) => {
                (kind, rest)
            }
            Some(("ws" | "wss", _)) => ("text", text),
            _ if text == "-" => ("-", text),
            _ if BagName::is_folder(Path::new(text)) => ("ros2-mcap", text),
            _ if LeRobotName::is_folder(Path::new(text)) => ("lerobot", text),
            _ if known.is_some() => return bad(known.unwrap_or_default()),
            _ if ending("csv") => ("csv", text),
            _ if ending("ndjson") || ending("jsonl") => ("ndjson", text),
            _ if ending("mcap") => ("mcap", text),
            // `.bag` is not read; but the file says what to do.
            _ if ending("db3") || ending("bag") => ("ros2-mcap", text),
            _ if EXPORTS.iter().any(|wanted| ending(wanted)) => ("export", text),
            Some((kind, _)) => {
                return match nearest(kind, kinds.iter().copied().filter(|kind| !kind.ends_with('-'))) {
                    Some(near) => bad(format!("there is no source `{kind}:`; did you mean `{near}:`?")),
                    None => bad(format!("this should be {forms}")),
                };
            }
            None => return bad(format!("this should be {forms}")),
        };
        if !kinds.contains(&kind) {
            return bad(format!("this should be {forms}"));
        }
        if rest.is_empty() {
            return bad(format!("nothing follows `{kind}:`; this should be {forms}"));
        }
        Ok(match kind {
            "csv" => Self::Csv(rest.into()),
            "ndjson" => Self::Ndjson(rest.into()),
            "mcap" => Self::Mcap(rest.into()),
            "ros2-mcap" => match rest.parse() {
                Ok(name) => Self::Ros2Mcap(name),
                Err(e) => return bad(e.to_string()),
            },
            "lerobot" => match rest.parse() {
                Ok(name) => Self::LeRobot(name),
                Err(e) => return bad(e.to_string()),
            },
            "export" => Self::Vendor(rest.into()),
            "sim" => Self::Sim(rest.into()),
            "text" => Self::Text(rest.parse()?),
            "modbus" => {
                let place = rest.strip_prefix("//").unwrap_or(rest);
                modbus::place_of(place).map(|_| Self::Modbus(place.to_owned()))?
            }
            "zenoh" => Self::Zenoh(crate::limb::checked_key(rest)?),
            "-" => Self::Stdin,
            "csv:-" => Self::CsvStdin,
            "ros2" => return topic(rest),
            "paxini" => port(kind, rest).map(|(port, baud)| Self::Paxini { port, baud })?,
            _ => port(kind, rest).map(|(port, baud)| Self::Serial { port, baud })?,
        })
    }

    /// Whether it is read from standard input.
    #[must_use]
    pub fn is_stdin(&self) -> bool {
        matches!(self, Self::Stdin | Self::CsvStdin | Self::Text(TextPlace::Stdin))
    }

    /// Whether it ends, and can be read again.
    #[must_use]
    pub fn is_recording(&self) -> bool {
        use SourceSpec::{CsvStdin, Modbus, Paxini, Ros2, Serial, Stdin, Text, Zenoh};
        let is_live = matches!(self, Stdin | CsvStdin | Text(_) | Serial { .. } | Ros2 { .. } | Modbus(_) | Zenoh(_));
        !(is_live || matches!(self, Paxini { .. }))
    }

    /// What it is by its file's content and by the options: a `.csv` may be an export.
    #[must_use]
    pub fn with_content(self, options: &VendorOptions) -> Self {
        match self {
            // Named columns are of a table.
            Self::Csv(path) if options.text.given().is_some() => Self::Csv(path),
            // Of other programs: a bag.
            Self::Mcap(path) if options.map.is_some() => Self::Ros2Mcap(BagName::new(path)),
            Self::Csv(path) if options.format.or_else(|| VendorSource::detect(&path)).is_some() => Self::Vendor(path),
            Self::Csv(path) if options.grid.is_some() => Self::Vendor(path),
            other => other,
        }
    }

    /// The file or folder that is read, if it is one.
    #[must_use]
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::Csv(path) | Self::Ndjson(path) | Self::Mcap(path) | Self::Vendor(path) | Self::Sim(path) => {
                Some(path)
            }
            Self::Ros2Mcap(name) => Some(&name.path),
            Self::LeRobot(name) => Some(&name.path),
            Self::Serial { .. } | Self::Text(_) | Self::Ros2 { .. } | Self::Modbus(_) | Self::Zenoh(_) => None,
            Self::Paxini { .. } | Self::Stdin | Self::CsvStdin => None,
        }
    }

    /// Checks that `options` say nothing that is not for this source.
    ///
    /// # Errors
    /// A usage error if they do.
    pub fn check_options(&self, options: &VendorOptions) -> Result<()> {
        if !matches!(self, Self::Vendor(_)) {
            options.check_unused(matches!(self, Self::Text(_)))?;
        }
        if options.map.is_some() {
            self.check_map(options)?;
        }
        let is_table = matches!(self, Self::Csv(_) | Self::CsvStdin);
        if is_table && options.text.frame_end.is_some() {
            return Err(Error::usage("--frame-end is for lines of text; leave it out here"));
        }
        if let Some(flag) = options.text.given().filter(|_| !matches!(self, Self::Text(_)) && !is_table) {
            return Err(Error::usage(format!(
                "{flag} is for lines of text and tables; add --source text:PORT or a CSV, or leave it out"
            )));
        }
        let is_text_stdin = matches!(self, Self::Text(TextPlace::Stdin));
        if options.rate_hz.is_some()
            && !is_text_stdin
            && !matches!(self, Self::Csv(_) | Self::CsvStdin | Self::Vendor(_))
        {
            return Err(Error::usage("--rate is for CSV recordings without a column `t`; leave it out here"));
        }
        Ok(())
    }

    /// Checks that a map is for this source.
    fn check_map(&self, options: &VendorOptions) -> Result<()> {
        use SourceSpec::{Modbus, Ndjson, Paxini, Ros2, Ros2Mcap, Stdin, Text};
        if !matches!(self, Ros2Mcap(_) | Ros2 { .. } | Modbus(_) | Paxini { .. } | Ndjson(_) | Stdin | Text(_)) {
            return Err(Error::usage(
                "--map is for ROS 2 bags and topics, NDJSON, lines of JSON, Modbus and PaXini; leave it out here, or name columns with --columns",
            ));
        }
        match options.text.given() {
            Some(flag) => Err(Error::usage(format!("the map has what {flag} says; write it there"))),
            None => Ok(()),
        }
    }

    /// The map that it has where none is given, by its name.
    #[must_use]
    pub fn usual_map(&self) -> Option<&'static str> {
        matches!(self, Self::Paxini { .. }).then_some("paxini")
    }

    /// Opens lines of JSON, or values of a device, by `map`; `None` where it is another source.
    ///
    /// # Errors
    /// They cannot be read, or have not what the map says.
    pub fn open_json(&self, map: &ArrayMap, skip_bad: bool) -> Result<Option<MappedSource>> {
        let messages: Box<dyn Messages + Send> = match self {
            Self::Stdin => Box::new(JsonLines::stdin(map)),
            Self::Ndjson(path) => Box::new(JsonLines::open(path, map)?),
            Self::Modbus(place) => Box::new(ModbusRegisters::connect(place, map)?),
            #[cfg(feature = "serial")]
            Self::Paxini { port, baud } => Box::new(super::map::paxini::PaxiniBoard::open(port, *baud, map)?),
            _ => return Ok(None),
        };
        MappedSource::new(messages, map, skip_bad).map(Some)
    }

    /// Opens the source. `taxels` are the ids that the body has; `options` say what its file does not, such as the rate of a
    /// CSV without a column `t`.
    ///
    /// # Errors
    /// It cannot be opened, or this build does not read it; a usage error if a rate is not allowed.
    pub fn open(&self, taxels: &[u32], options: &VendorOptions) -> Result<Box<dyn Source + Send>> {
        self.check_options(options)?;
        let skip_bad = options.skip_bad;
        let usual = self.usual_map().map(ArrayMap::named).transpose()?;
        if let Some(map) = options.map.as_ref().or(usual.as_ref())
            && let Some(source) = self.open_json(map, skip_bad)?
        {
            return Ok(Box::new(source.for_body(taxels)?));
        }
        match self {
            Self::Csv(path) => Ok(Box::new(CsvSource::open_for(path, options, taxels)?)),
            Self::CsvStdin => {
                Ok(Box::new(CsvSource::from_reader_for("stdin", std::io::stdin(), None, options, taxels)?))
            }
            Self::Stdin => Ok(Box::new(NdjsonSource::stdin(taxels.to_vec()).skip_bad(skip_bad))),
            Self::Ndjson(path) => Ok(Box::new(NdjsonSource::open(path, taxels.to_vec())?.skip_bad(skip_bad))),
            #[cfg(feature = "mcap")]
            Self::Mcap(path) => Ok(Box::new(crate::recording::Reader::open(path)?)),
            #[cfg(not(feature = "mcap"))]
            Self::Mcap(path) => {
                Err(Error::failed("this build reads no MCAP; build with feature `mcap`").at(path.display()))
            }
            Self::Vendor(path) => Ok(Box::new(VendorSource::open(path, options)?)),
            Self::Text(place) => Ok(Box::new(TextSource::open(place, options, &mut |_| {})?.for_body(taxels)?)),
            Self::Sim(path) => Ok(Box::new(SimulatedSource::open(path)?)),
            Self::Ros2Mcap(name) => {
                let what = if cfg!(feature = "mcap") {
                    "a ROS 2 bag is read for a body: by `somatic run`, or `robot::BagSource`"
                } else {
                    "this build reads no MCAP; build with feature `mcap`"
                };
                Err(Error::failed(what).at(name.path.display()))
            }
            #[cfg(feature = "parquet")]
            Self::LeRobot(name) => Ok(Box::new(super::LeRobotSource::open(name, taxels)?)),
            #[cfg(not(feature = "parquet"))]
            Self::LeRobot(name) => Err(Error::failed(refused::NO_PARQUET).at(name.path.display())),
            Self::Modbus(_) => {
                Err(Error::usage("a map names the registers that are sensors; add --map FILE, or --map inspire")
                    .at(self))
            }
            Self::Ros2 { topic, .. } => {
                let what = "a topic of ROS 2 is read live, by `somatic run` in a build with feature `ros2`: cargo install \
                            --path . --features ros2";
                Err(Error::failed(what).at(format!("source `ros2:{topic}`")))
            }
            #[cfg(feature = "serial")]
            Self::Serial { port, baud } => {
                let ports = [(port.clone(), *baud)];
                Ok(Box::new(super::SerialSource::open(&ports, taxels, &super::SerialOptions::default())?))
            }
            #[cfg(feature = "zenoh")]
            Self::Zenoh(key) => {
                let keys = std::slice::from_ref(key);
                Ok(Box::new(super::LimbSource::open(keys, taxels, &super::LimbOptions::default())?))
            }
            #[cfg(not(feature = "zenoh"))]
            Self::Zenoh(key) => {
                let what = "built without the feature `zenoh`: cargo install --path . --features zenoh";
                Err(Error::failed(what).at(format!("source `zenoh:{key}`")))
            }
            #[cfg(feature = "serial")]
            Self::Paxini { .. } => Err(Error::failed("this source needs --map").at(self)),
            #[cfg(not(feature = "serial"))]
            Self::Serial { port, .. } | Self::Paxini { port, .. } => {
                Err(Error::failed("this build reads no serial lines; build with feature `serial`").at(port))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_is_named_as_people_write_it() {
        let parsed = |text: &str| text.parse::<SourceSpec>().unwrap();
        assert_eq!(parsed("csv:a/b.txt"), SourceSpec::Csv("a/b.txt".into()));
        assert_eq!(parsed("a/b.CSV"), SourceSpec::Csv("a/b.CSV".into()));
        assert_eq!(parsed("a/b.jsonl"), SourceSpec::Ndjson("a/b.jsonl".into()));
        assert_eq!(parsed("C:\\b.csv"), SourceSpec::Csv("C:\\b.csv".into()));
        let bag = BagName { topics: vec!["/arm/skin".into()], ..BagName::new("a/bag") };
        assert_eq!(parsed("ros2-mcap:a/bag:/arm/skin"), SourceSpec::Ros2Mcap(bag));
        assert_eq!(parsed("-"), SourceSpec::Stdin);
        assert_eq!(parsed("csv:-"), SourceSpec::CsvStdin);
        assert_eq!(parsed("sim:touch.toml"), SourceSpec::Sim("touch.toml".into()));
        assert_eq!(parsed("serial:COM3"), SourceSpec::Serial { port: "COM3".into(), baud: None });
        let ros2 = |kind: Option<&str>| SourceSpec::Ros2 { topic: "/arm/skin".into(), kind: kind.map(str::to_owned) };
        assert_eq!(parsed("ros2:/arm/skin"), ros2(None));
        assert_eq!(parsed("modbus://hand:6000/2"), SourceSpec::Modbus("hand:6000/2".into()));
        let cloud = Some("sensor_msgs/msg/PointCloud2");
        assert_eq!(parsed("ros2:/arm/skin@sensor_msgs/msg/PointCloud2"), ros2(cloud));
        assert_eq!(parsed("ros2:/arm/skin@sensor_msgs/PointCloud2"), ros2(cloud));
        let port = "/dev/ttyUSB0".to_owned();
        assert_eq!(parsed("serial:/dev/ttyUSB0@921600"), SourceSpec::Serial { port, baud: Some(921_600) });
    }

    #[test]
    fn a_source_is_written_as_it_is_named() {
        for text in [
            "csv:a/b.txt",
            "ndjson:a/b.txt",
            "serial:/dev/ttyUSB0",
            "serial:COM3@921600",
            "paxini:/dev/ttyUSB0",
            "paxini:COM3@115200",
            "ros2:/arm/skin",
            "ros2:/arm/skin@sensor_msgs/msg/PointCloud2",
            "zenoh:robot/left",
            "mcap:a.mcap",
            "ros2-mcap:a/bag:/arm/skin",
            "lerobot:a/pick:observation.tactile#3",
            "walk.lst",
            "sim:touch.toml",
            "-",
            "csv:-",
        ] {
            assert_eq!(text.parse::<SourceSpec>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn what_is_no_source_is_a_usage_error_with_a_way_out() {
        let why = |text: &str| {
            let error = text.parse::<SourceSpec>().unwrap_err();
            assert!(error.is_usage());
            error.to_string()
        };
        assert!(why("csv:").contains("nothing follows"));
        assert!(why("ros2-mcap:").contains("nothing follows"));
        assert!(why("seril:a").contains("did you mean `serial:`"));
        assert!(why("ros2:skin").contains("write ros2:/TOPIC") && why("ros2:/a@").contains("write ros2:/TOPIC"));
        assert!(why("a.pdf").contains(
            "csv:FILE, ndjson:FILE, serial:PORT[@BAUD], text:PORT[@BAUD] (or text:tcp://HOST:PORT, text:udp://:PORT, text:-) for lines of numbers, ros2:/TOPIC[@TYPE], modbus://HOST[:PORT][/UNIT], paxini:PORT[@BAUD], zenoh:KEY, mcap:FILE, ros2-mcap:PATH[:/TOPIC,...][@TYPE], lerobot:DIR[:FEATURE][#EPISODE], a pressure system's .csv, .asf, .lst, .asc or .txt, sim:FILE.toml, \
             - for NDJSON on standard input or csv:- for CSV"
        ));
        let of_recordings = |text: &str| SourceSpec::one_of(text, &["csv", "mcap"]).unwrap_err().to_string();
        for text in ["a.ndjson", "-", "csv:-", "sim:a.toml", "serial:a", "csv:", "seril:a"] {
            let why = of_recordings(text);
            assert!(why.ends_with("this should be csv:FILE or mcap:FILE"), "{text}: {why}");
        }
        assert!(of_recordings("mcp:a").contains("did you mean `mcap:`"));
        assert!(why("").contains("csv:FILE"));
        assert!(why("serial:a@fast").contains("baud"));
        for port in ["/dev/ttyUSB0", "/dev/ttyACM0@9600", "/dev/serial/by-path/pci-0:1.0-port0", "/dev/cu.usb1", "COM3"]
        {
            let why = why(port);
            assert!(why.contains(&format!("text:{port} if")) && why.contains(&format!("serial:{port} if")), "{why}");
        }
        assert!(why("COM3.pdf").contains("csv:FILE"));
    }

    #[test]
    fn what_is_not_there_says_so() {
        assert!(SourceSpec::Mcap("no/such.mcap".into()).open(&[1], &VendorOptions::default()).is_err());
        assert!(
            SourceSpec::Sim("no/such.toml".into()).open(&[1], &VendorOptions::default()).err().unwrap().kind()
                == crate::error::ErrorKind::NotFound
        );
        assert!(
            SourceSpec::Stdin
                .open(&[1], &VendorOptions { rate_hz: Some(3.0), ..VendorOptions::default() })
                .err()
                .unwrap()
                .is_usage()
        );
        assert!(
            SourceSpec::Csv("no/such.csv".into()).open(&[1], &VendorOptions::default()).err().unwrap().kind()
                == crate::error::ErrorKind::NotFound
        );
    }
}
