//! Paths in a scene file, which are relative to its folder.

use std::path::{Path, PathBuf};

use super::{SceneFile, StatesSpec};
use crate::bundled;
use crate::sink::SinkSpec;
use crate::source::{ArrayMap, BagName, LeRobotName, SourceSpec};

impl SceneFile {
    /// It with paths that are relative to where we are, where it is in `folder`.
    pub(super) fn within(self, folder: &Path) -> Self {
        let there = |file: PathBuf| folder.join(file);
        Self {
            calibration: self.calibration.map(there),
            wiring: self.wiring.map(there),
            layout: self.layout.map(there),
            // A preset, unless a file is called the same.
            map: self.map.map(|map| match there(map.clone().into()) {
                file if file.exists() || !ArrayMap::is_preset(&map) => file.display().to_string(),
                _ => map,
            }),
            zenoh_config: self.zenoh_config.map(there),
            joints: self.joints.map(there),
            joint_states: self.joint_states.map(|states| states_within(folder, states)),
            poses: self.poses.map(|poses| states_within(folder, poses)),
            // A bundled body, unless a file is called the same.
            body: self.body.map(|body| match there(body.clone().into()) {
                file if file.exists() || bundled::body(&body).is_none() => file.display().to_string(),
                _ => body,
            }),
            sources: self.sources.into_iter().map(|source| source_within(folder, source)).collect(),
            sinks: self.sinks.into_iter().map(|sink| sink_within(folder, sink)).collect(),
            ..self
        }
    }
}

fn bag_within(folder: &Path, bag: BagName) -> BagName {
    BagName { path: folder.join(&bag.path), ..bag }
}

fn source_within(folder: &Path, source: SourceSpec) -> SourceSpec {
    match source {
        SourceSpec::Csv(file) => SourceSpec::Csv(folder.join(file)),
        SourceSpec::Ndjson(file) => SourceSpec::Ndjson(folder.join(file)),
        SourceSpec::Mcap(file) => SourceSpec::Mcap(folder.join(file)),
        SourceSpec::Ros2Mcap(bag) => SourceSpec::Ros2Mcap(bag_within(folder, bag)),
        SourceSpec::LeRobot(name) => SourceSpec::LeRobot(LeRobotName { path: folder.join(&name.path), ..name }),
        SourceSpec::Vendor(file) => SourceSpec::Vendor(folder.join(file)),
        SourceSpec::Sim(file) => SourceSpec::Sim(folder.join(file)),
        live => live,
    }
}

fn sink_within(folder: &Path, sink: SinkSpec) -> SinkSpec {
    match sink {
        on_stdout if on_stdout.is_on_stdout() => on_stdout,
        SinkSpec::Ndjson(file) => SinkSpec::Ndjson(folder.join(file)),
        SinkSpec::Csv(file) => SinkSpec::Csv(folder.join(file)),
        SinkSpec::Parquet(file) => SinkSpec::Parquet(folder.join(file)),
        SinkSpec::Mcap(file) => SinkSpec::Mcap(folder.join(file)),
        SinkSpec::Ros2Mcap(bag) => SinkSpec::Ros2Mcap(folder.join(bag)),
        live => live,
    }
}

fn states_within(folder: &Path, states: PathBuf) -> PathBuf {
    match StatesSpec::named(&states) {
        Ok(StatesSpec::Bag(bag)) if states != bag.path => format!("ros2-mcap:{}", bag_within(folder, bag)).into(),
        // The checks report its errors.
        Ok(StatesSpec::Topic(_)) | Err(_) => states,
        Ok(StatesSpec::File(_) | StatesSpec::Bag(_)) => folder.join(states),
    }
}
