//! Names in a scene file, whose paths are relative to its folder.

use std::path::{Path, PathBuf};

use somatic::Result;
use somatic::sink::SinkSpec;
use somatic::source::{BagName, SourceSpec};

use crate::cli::states_from::StatesFrom;

fn there(folder: &Path, file: &Path) -> String {
    folder.join(file).display().to_string()
}

fn bag_there(folder: &Path, bag: BagName) -> String {
    format!("ros2-mcap:{}", BagName { path: folder.join(&bag.path), ..bag })
}

/// The source that a scene file in `folder` names.
pub(super) fn source_within(folder: &Path, source: &str) -> Result<String> {
    Ok(match source.parse()? {
        SourceSpec::Csv(file) => format!("csv:{}", there(folder, &file)),
        SourceSpec::Mcap(file) => format!("mcap:{}", there(folder, &file)),
        SourceSpec::Ros2Mcap(bag) => bag_there(folder, bag),
        SourceSpec::Vendor(file) => there(folder, &file),
        SourceSpec::Sim(file) => format!("sim:{}", there(folder, &file)),
        _ => source.to_owned(),
    })
}

/// The sink that a scene file in `folder` names.
pub(super) fn sink_within(folder: &Path, sink: &str) -> Result<String> {
    Ok(match sink.parse()? {
        spec if SinkSpec::is_on_stdout(&spec) => sink.to_owned(),
        SinkSpec::Ndjson(file) => format!("ndjson:{}", there(folder, &file)),
        SinkSpec::Csv(file) => format!("csv:{}", there(folder, &file)),
        SinkSpec::Parquet(file) => format!("parquet:{}", there(folder, &file)),
        SinkSpec::Mcap(file) => format!("mcap:{}", there(folder, &file)),
        SinkSpec::Ros2Mcap(bag) => format!("ros2-mcap:{}", there(folder, &bag)),
        _ => sink.to_owned(),
    })
}

/// The joint states that a scene file in `folder` names.
pub(super) fn states_within(folder: &Path, states: PathBuf) -> Result<PathBuf> {
    if let Some(name) = states.to_str().and_then(|text| text.strip_prefix("ros2-mcap:")) {
        return Ok(bag_there(folder, name.parse()?).into());
    }
    let named = StatesFrom::named(&states)?;
    Ok(if matches!(named, StatesFrom::Topic(_)) { states } else { folder.join(states) })
}
