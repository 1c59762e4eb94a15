//! Parses the names of sinks.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::table::path_beside;
use super::{CsvSink, NdjsonSink, Session, Sink, header};
use crate::error::{Error, Result, nearest, unknown};
use crate::limb::{LimbSends, checked_key};
use crate::output::{OutputPath, OutputPaths, STANDARD_OUTPUT};
use crate::percept::Outputs;

const FORMS: &str = "ndjson:FILE, csv:FILE, parquet:FILE, mcap:FILE, ros2-mcap:FOLDER, ros2[:/NAMESPACE], page[:HOST:PORT], zenoh:KEY, zenoh-percepts:KEY, or - for NDJSON on standard output (csv:- is a table there)";

/// A sink as named on a command line or in a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SinkSpec {
    /// `ndjson:FILE`, or a bare `FILE.ndjson`: a line of JSON a frame.
    Ndjson(PathBuf),
    /// `csv:FILE`, or a bare `FILE.csv`: a table, a row per frame and field in contact. `csv:-` is standard output.
    Csv(PathBuf),
    /// `parquet:FILE`, or a bare `FILE.parquet`: the same table in Parquet.
    Parquet(PathBuf),
    /// `mcap:FILE`, or a bare `FILE.mcap`: a recording in MCAP.
    Mcap(PathBuf),
    /// `ros2-mcap:FOLDER`: a bag of ROS 2.
    Ros2Mcap(PathBuf),
    /// `ros2` or `ros2:/NAMESPACE`: topics of ROS 2, live; the namespace is empty or begins with `/`.
    Ros2(String),
    /// `page` or `page:HOST:PORT`: a page for browsers, at an address of this machine.
    Page(Option<String>),
    /// `zenoh:KEY` or `zenoh-percepts:KEY`: a limb's frames or percepts, to another computer.
    Zenoh {
        /// Under which key of Zenoh's.
        key: String,
        /// What.
        sends: LimbSends,
    },
    /// `-`: NDJSON on standard output.
    Stdout,
}

impl FromStr for SinkSpec {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text {
            "-" => return Ok(Self::Stdout),
            "page" => return Ok(Self::Page(None)),
            "ros2" => return Ok(Self::Ros2(String::new())),
            _ => {}
        }
        let ending = |wanted: &str| Path::new(text).extension().is_some_and(|own| own.eq_ignore_ascii_case(wanted));
        let bad = |what: String| Err(Error::usage(what).at(format!("sink `{text}`")));
        let (kind, rest) = text.split_once(':').unwrap_or(("", text));
        match kind {
            "ndjson" | "csv" | "parquet" | "mcap" | "ros2-mcap" | "zenoh" | "zenoh-percepts" if rest.is_empty() => {
                bad(format!("nothing follows `{kind}:`; {FORMS}"))
            }
            "ndjson" if rest == STANDARD_OUTPUT => Ok(Self::Stdout),
            "ndjson" => Ok(Self::Ndjson(rest.into())),
            "csv" => Ok(Self::Csv(rest.into())),
            "parquet" => Ok(Self::Parquet(rest.into())),
            "mcap" => Ok(Self::Mcap(rest.into())),
            "ros2-mcap" => Ok(Self::Ros2Mcap(rest.into())),
            "ros2" if is_namespace(rest) => Ok(Self::Ros2(rest.to_owned())),
            "ros2" => {
                bad(format!("`{rest}` is not a namespace; write ros2, or ros2:/left_arm (letters, digits and _)"))
            }
            "page" if rest.is_empty() => bad("nothing follows `page:`; give HOST:PORT, or `page` alone".to_owned()),
            "page" => Ok(Self::Page(Some(rest.to_owned()))),
            "zenoh" | "zenoh-percepts" => {
                let key = checked_key(rest).map_err(|e| e.at(format!("sink `{text}`")))?;
                let sends = if kind == "zenoh" { LimbSends::Frames } else { LimbSends::Percepts };
                Ok(Self::Zenoh { key, sends })
            }
            _ if ending("ndjson") => Ok(Self::Ndjson(text.into())),
            _ if ending("csv") => Ok(Self::Csv(text.into())),
            _ if ending("parquet") => Ok(Self::Parquet(text.into())),
            _ if ending("mcap") => Ok(Self::Mcap(text.into())),
            kind => match nearest(
                kind,
                ["ndjson", "csv", "parquet", "mcap", "ros2-mcap", "ros2", "page", "zenoh", "zenoh-percepts"],
            ) {
                Some(near) => bad(format!("there is no sink `{kind}:`; did you mean `{near}:`?")),
                None => bad(format!("a sink is one of {FORMS}")),
            },
        }
    }
}

/// As it is named, the kind first.
impl fmt::Display for SinkSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ndjson(path) => write!(f, "ndjson:{}", path.display()),
            Self::Csv(path) => write!(f, "csv:{}", path.display()),
            Self::Parquet(path) => write!(f, "parquet:{}", path.display()),
            Self::Mcap(path) => write!(f, "mcap:{}", path.display()),
            Self::Ros2Mcap(path) => write!(f, "ros2-mcap:{}", path.display()),
            Self::Ros2(namespace) if namespace.is_empty() => f.write_str("ros2"),
            Self::Ros2(namespace) => write!(f, "ros2:{namespace}"),
            Self::Page(None) => f.write_str("page"),
            Self::Page(Some(address)) => write!(f, "page:{address}"),
            Self::Zenoh { key, sends: LimbSends::Frames } => write!(f, "zenoh:{key}"),
            Self::Zenoh { key, sends: LimbSends::Percepts } => write!(f, "zenoh-percepts:{key}"),
            Self::Stdout => f.write_str("-"),
        }
    }
}

/// The tables of percepts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TableName {
    /// A row per frame and field in contact.
    Fields,
    /// A row per frame and separate touch.
    Touches,
    /// A row per frame and contact between links.
    SelfContacts,
}

impl FromStr for TableName {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let all = [("fields", Self::Fields), ("touches", Self::Touches), ("self_contacts", Self::SelfContacts)];
        if let Some((_, table)) = all.iter().find(|(known, _)| *known == name) {
            return Ok(*table);
        }
        Err(Error::usage(unknown("table", name, all.map(|(known, _)| known))))
    }
}

/// What is asked of tables.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TableWish {
    /// Whether a CSV has one row per frame, with columns of their own for each field.
    pub wide: bool,
    /// Whether touches are asked for: they go into a second file, `percepts.touches.csv` beside `percepts.csv`.
    pub touches: bool,
    /// Whether self-contacts are: they go into a third file, `percepts.self_contacts.csv`.
    pub self_contacts: bool,
    /// Whether anything of fields is.
    pub fields: bool,
    /// The table that goes to standard output, which has room for one. `None`: fields, or touches where nothing is asked of fields.
    pub on_stdout: Option<TableName>,
}

impl TableWish {
    /// What tables of `outputs` are to have, with `touches` or without.
    #[must_use]
    pub fn new(outputs: Outputs, touches: bool, wide: bool) -> Self {
        let self_contacts = outputs.contains(Outputs::SELF_CONTACTS);
        Self { wide, touches: touches || self_contacts, self_contacts, fields: !outputs.is_empty(), on_stdout: None }
    }

    /// The same, with this table on standard output.
    ///
    /// # Errors
    /// It is not computed.
    pub fn on_stdout(self, table: Option<TableName>) -> Result<Self> {
        let is_there = match table {
            Some(TableName::Touches) => self.touches,
            Some(TableName::SelfContacts) => self.self_contacts,
            Some(TableName::Fields) | None => true,
        };
        let name = if table == Some(TableName::Touches) { "touches" } else { "self_contacts" };
        if !is_there {
            return Err(Error::usage(format!("{name} are not computed; ask for them with --outputs {name}")));
        }
        Ok(Self { on_stdout: table, ..self })
    }

    fn table_on_stdout(self) -> TableName {
        let touches_alone = self.touches && !self.fields && !self.wide;
        self.on_stdout.unwrap_or(if touches_alone { TableName::Touches } else { TableName::Fields })
    }
}

impl SinkSpec {
    /// Whether it is a table; [`TableWish`] says more about it.
    #[must_use]
    pub fn is_table(&self) -> bool {
        matches!(self, Self::Csv(_) | Self::Parquet(_))
    }

    /// Whether it is a table in CSV on standard output.
    #[must_use]
    pub fn is_table_on_stdout(&self) -> bool {
        matches!(self, Self::Csv(path) if path.as_os_str() == STANDARD_OUTPUT)
    }

    /// Whether it goes to standard output.
    #[must_use]
    pub fn is_on_stdout(&self) -> bool {
        match self {
            Self::Stdout => true,
            Self::Csv(path) | Self::Parquet(path) | Self::Mcap(path) => path.as_os_str() == STANDARD_OUTPUT,
            _ => false,
        }
    }

    /// Whether somebody watches it: a recording is then played as fast as it was.
    #[must_use]
    pub fn is_watched(&self) -> bool {
        matches!(self, Self::Page(_) | Self::Ros2(_))
    }

    /// Whether it has frames as well as percepts, and so nothing to write of percepts alone.
    #[must_use]
    pub fn needs_frames(&self) -> bool {
        matches!(self, Self::Ros2Mcap(_) | Self::Ros2(_) | Self::Page(_) | Self::Zenoh { sends: LimbSends::Frames, .. })
    }

    /// Reserves its files or standard output among a command's `outputs`. A page is also for the host names `allow_hosts`.
    ///
    /// # Errors
    /// As [`OutputPaths::add`]; a page cannot be at this address, or for these hosts.
    #[cfg_attr(not(feature = "page"), expect(unused_variables, reason = "only a page is for hosts"))]
    pub fn target(&self, outputs: &mut OutputPaths, allow_hosts: &[String], table: TableWish) -> Result<SinkTarget> {
        let beside = |path: &Path, outputs: &mut OutputPaths| {
            let mut add = |is_asked: bool, what| is_asked.then(|| outputs.add(path_beside(path, what))).transpose();
            Ok::<_, Error>((add(table.touches, "touches")?, add(table.self_contacts, "self_contacts")?))
        };
        Ok(match self {
            #[cfg(feature = "page")]
            Self::Page(address) => SinkTarget::Page(crate::page::Listen::new(address.as_deref(), allow_hosts)?),
            #[cfg(not(feature = "page"))]
            Self::Page(_) => return Err(Error::failed("built without the feature `page`").at("sink `page`")),
            Self::Ndjson(path) => SinkTarget::Ndjson(outputs.add(path)?),
            Self::Csv(path) if self.is_table_on_stdout() => {
                let (mut percepts, mut touches, mut self_contacts) = (None, None, None);
                let place = match table.table_on_stdout() {
                    TableName::Fields => &mut percepts,
                    TableName::Touches => &mut touches,
                    TableName::SelfContacts => &mut self_contacts,
                };
                *place = Some(outputs.add(path)?);
                SinkTarget::Csv { percepts, touches, self_contacts, wide: table.wide }
            }
            Self::Csv(path) => {
                let percepts = Some(outputs.add(path)?);
                let (touches, self_contacts) = beside(path, outputs)?;
                SinkTarget::Csv { percepts, touches, self_contacts, wide: table.wide }
            }
            Self::Parquet(path) => {
                if cfg!(not(feature = "parquet")) {
                    let what = "built without the feature `parquet`: cargo install --path . --features parquet; or use csv:FILE";
                    return Err(Error::failed(what).at(path.display()));
                }
                if self.is_on_stdout() && (table.touches || table.self_contacts) {
                    let what =
                        "standard output has room for one table; name a file, or choose one with csv:- and --table";
                    return Err(Error::usage(what).at("sink `parquet:-`"));
                }
                let percepts = outputs.add(path)?;
                let (touches, self_contacts) = beside(path, outputs)?;
                SinkTarget::Parquet { percepts, touches, self_contacts }
            }
            Self::Mcap(path) => SinkTarget::Mcap(outputs.add(path)?),
            #[cfg(feature = "mcap")]
            Self::Ros2Mcap(path) => {
                let file_name = bag_file_name(path);
                let names = [file_name.as_str(), crate::recording::BAG_METADATA];
                SinkTarget::Ros2Mcap { folder: outputs.add_folder(path, names)?, file_name }
            }
            #[cfg(not(feature = "mcap"))]
            Self::Ros2Mcap(path) => {
                return Err(Error::failed("built without the feature `mcap`; use ndjson:FILE").at(path.display()));
            }
            #[cfg(feature = "ros2")]
            Self::Ros2(namespace) => SinkTarget::Ros2(namespace.clone()),
            #[cfg(not(feature = "ros2"))]
            Self::Ros2(_) => {
                let what =
                    "built without the feature `ros2`: cargo install --path . --features ros2; or use ros2-mcap:FOLDER";
                return Err(Error::failed(what).at("sink `ros2`"));
            }
            Self::Zenoh { key, .. } if cfg!(not(feature = "zenoh")) => {
                let what = "built without the feature `zenoh`: cargo install --path . --features zenoh";
                return Err(Error::failed(what).at(format!("sink `zenoh:{key}`")));
            }
            Self::Zenoh { key, sends } => SinkTarget::Zenoh { key: key.clone(), sends: *sends },
            Self::Stdout => {
                outputs.add_standard_output()?;
                SinkTarget::Stdout
            }
        })
    }
}

/// A sink whose output is reserved and overwrites no input.
#[derive(Debug)]
#[non_exhaustive]
pub enum SinkTarget {
    /// A line of JSON a frame.
    Ndjson(OutputPath),
    /// A table in CSV.
    Csv {
        /// The file; `None` if standard output has another table.
        percepts: Option<OutputPath>,
        /// That of touches.
        touches: Option<OutputPath>,
        /// That of self-contacts.
        self_contacts: Option<OutputPath>,
        /// Whether it has one row per frame.
        wide: bool,
    },
    /// A table in Parquet.
    Parquet {
        /// The file.
        percepts: OutputPath,
        /// That of touches.
        touches: Option<OutputPath>,
        /// That of self-contacts.
        self_contacts: Option<OutputPath>,
    },
    /// A recording in MCAP.
    Mcap(OutputPath),
    /// A bag of ROS 2.
    #[cfg(feature = "mcap")]
    Ros2Mcap {
        /// The bag's folder.
        folder: crate::output::OutputFolder,
        /// What its MCAP is called.
        file_name: String,
    },
    /// Topics of ROS 2 in a namespace.
    #[cfg(feature = "ros2")]
    Ros2(String),
    /// A page for browsers.
    #[cfg(feature = "page")]
    Page(crate::page::Listen),
    /// A limb's frames or percepts, to another computer.
    Zenoh {
        /// Under which key of Zenoh's.
        key: String,
        /// What.
        sends: LimbSends,
    },
    /// NDJSON on standard output.
    Stdout,
}

impl SinkTarget {
    /// Whether it holds the files that say what is run ([`Session::attached`]).
    #[must_use]
    pub fn holds_attached(&self) -> bool {
        matches!(self, Self::Mcap(_) | Self::Parquet { .. })
    }

    /// Opens the sink for `session`.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn open(self, session: &Session<'_>) -> Result<Box<dyn Sink + Send>> {
        let (names, all_fields) = (&session.names, session.all_fields);
        let skin = session.skin();
        let header = session.plan.filter(|_| session.header).map(|plan| header::line(plan, session.body));
        // Where no touches are looked for, there is no table of them.
        let of_touches = |touches: Option<OutputPath>| touches.filter(|_| skin.is_some());
        match self {
            Self::Ndjson(output) => Ok(Box::new(
                NdjsonSink::to_file(output, names, all_fields)?
                    .with_skin(skin.as_ref())
                    .with_header(header.as_deref())?,
            )),
            Self::Stdout => {
                let sink = NdjsonSink::to_writer("standard output", std::io::stdout(), names, all_fields)
                    .with_skin(skin.as_ref());
                Ok(Box::new(sink.with_header(header.as_deref())?))
            }
            Self::Csv { percepts: None, touches: Some(_), .. } if skin.is_none() => Err(Error::usage(
                "there is no table of touches: they are found in pressures, which no taxel of the body measures; choose the table of fields",
            )),
            Self::Csv { percepts, touches, self_contacts, wide } => {
                Ok(Box::new(CsvSink::create(percepts, of_touches(touches), self_contacts, wide, session)?))
            }
            #[cfg(feature = "parquet")]
            Self::Parquet { percepts, touches, self_contacts } => {
                Ok(Box::new(super::ParquetSink::create(percepts, of_touches(touches), self_contacts, session)?))
            }
            #[cfg(not(feature = "parquet"))]
            Self::Parquet { percepts, .. } => {
                Err(Error::failed("built without the feature `parquet`").at(percepts.name().display()))
            }
            #[cfg(feature = "zenoh")]
            Self::Zenoh { key, sends } => Ok(Box::new(super::ZenohSink::open(&key, sends, session)?)),
            #[cfg(not(feature = "zenoh"))]
            Self::Zenoh { key, .. } => Err(Error::failed("built without the feature `zenoh`").at(key)),
            #[cfg(feature = "page")]
            Self::Page(listen) => Ok(Box::new(super::PageSink::start(&listen, session)?)),
            #[cfg(feature = "mcap")]
            Self::Ros2Mcap { folder, file_name } => {
                Ok(Box::new(super::Ros2BagSink::create(folder, &file_name, session)?))
            }
            #[cfg(feature = "ros2")]
            Self::Ros2(namespace) => Ok(Box::new(super::Ros2Sink::start(&namespace, session)?)),
            #[cfg(feature = "mcap")]
            Self::Mcap(output) => Ok(Box::new(super::RecordingSink::create(output, session)?)),
            #[cfg(not(feature = "mcap"))]
            Self::Mcap(output) => {
                Err(Error::failed("built without the feature `mcap`; use ndjson:FILE").at(output.name().display()))
            }
        }
    }
}

/// Whether `text` is a namespace of ROS 2 that begins with `/`.
fn is_namespace(text: &str) -> bool {
    let is_part = |part: &str| {
        part.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && part.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
            && !part.contains("__")
    };
    text.strip_prefix('/').is_some_and(|rest| rest.split('/').all(is_part))
}

/// What the MCAP of the bag at `path` is called: as the folder, with the number that ROS 2 counts files by.
#[cfg(feature = "mcap")]
fn bag_file_name(path: &Path) -> String {
    let stem = path.file_name().map_or_else(|| "bag".to_owned(), |name| name.to_string_lossy().into_owned());
    format!("{stem}_0.mcap")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sink_is_written_as_it_is_named() {
        for text in [
            "-",
            "ndjson:a",
            "csv:-",
            "csv:a/b.csv",
            "parquet:a",
            "mcap:a",
            "ros2-mcap:bag",
            "ros2",
            "ros2:/left_arm",
            "page",
            "page:127.0.0.1:0",
            "zenoh:robot/left",
            "zenoh-percepts:robot/left",
        ] {
            assert_eq!(text.parse::<SinkSpec>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn a_sink_is_named_as_people_write_it() {
        let parsed = |text: &str| text.parse::<SinkSpec>().unwrap();
        assert_eq!(parsed("-"), SinkSpec::Stdout);
        assert_eq!(parsed("ndjson:-"), SinkSpec::Stdout);
        for (text, is_there) in [("-", true), ("csv:-", true), ("mcap:-", true), ("csv:./-", false), ("page", false)] {
            assert_eq!(parsed(text).is_on_stdout(), is_there, "{text}");
        }
        assert_eq!(parsed("page"), SinkSpec::Page(None));
        assert_eq!(parsed("page:127.0.0.1:0"), SinkSpec::Page(Some("127.0.0.1:0".into())));
        assert_eq!(parsed("ndjson:a/b"), SinkSpec::Ndjson("a/b".into()));
        assert_eq!(parsed("a.ndjson"), SinkSpec::Ndjson("a.ndjson".into()));
        assert_eq!(parsed("mcap:a.mcap"), SinkSpec::Mcap("a.mcap".into()));
        assert_eq!(parsed("ros2-mcap:bag"), SinkSpec::Ros2Mcap("bag".into()));
        #[cfg(feature = "mcap")]
        assert_eq!(bag_file_name(Path::new("some/bag")), "bag_0.mcap");
        assert_eq!(parsed("ros2"), SinkSpec::Ros2(String::new()));
        assert_eq!(parsed("ros2:/left/arm_2"), SinkSpec::Ros2("/left/arm_2".into()));
        let why = |text: &str| {
            let error = text.parse::<SinkSpec>().unwrap_err();
            assert!(error.is_usage());
            error.to_string()
        };
        assert!(why("json:a").contains("did you mean `ndjson:`"));
        assert!(why("page:").contains("HOST:PORT") && why("pgae:x").contains("did you mean `page:`"));
        assert!(why("ndjson:").contains("nothing follows"));
        for text in ["ros2:", "ros2:arm", "ros2:/", "ros2:/a/", "ros2:/2a", "ros2:/a b", "ros2:/a__b"] {
            assert!(why(text).contains("is not a namespace"), "{text}");
        }
        assert!(why("a.txt").contains("ndjson:FILE"));
        assert_eq!(parsed("csv:a"), SinkSpec::Csv("a".into()));
        let zenoh = |sends| SinkSpec::Zenoh { key: "robot/arm".into(), sends };
        assert_eq!(parsed("zenoh:robot/arm"), zenoh(LimbSends::Frames));
        assert_eq!(parsed("zenoh-percepts:robot/arm"), zenoh(LimbSends::Percepts));
        assert!(why("zenoh:robot/*").contains("`*`") && why("zenoh:").contains("nothing follows"));
        assert_eq!(parsed("a.csv"), SinkSpec::Csv("a.csv".into()));
        assert_eq!(parsed("a/b.parquet"), SinkSpec::Parquet("a/b.parquet".into()));
        assert!(why("parqet:a").contains("did you mean `parquet:`") && why("csv:").contains("nothing follows"));
        assert_eq!(parsed("a.mcap"), SinkSpec::Mcap("a.mcap".into()));
    }
}
