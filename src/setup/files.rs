//! The files that a command reads: none of its outputs may be one of them.

use std::path::{Path, PathBuf};

use crate::body::Body;
use crate::output::OutputPaths;
use crate::scene_file::{SceneFile, StatesSpec, bag_of};
use crate::source::{BagName, SimulatedSource, SourceSpec};

/// Files that a command reads, whether they are there or not.
#[derive(Debug, Default)]
pub struct FilesRead(Vec<PathBuf>);

impl FilesRead {
    /// The files that `asked` names, by flags or by the scene file at `scene`.
    pub fn from_scene(asked: &SceneFile, scene: Option<&Path>) -> Self {
        let named = scene.into_iter().chain(asked.calibration.as_deref()).chain(asked.wiring.as_deref());
        let named = named.chain(asked.layout.as_deref()).chain(asked.map.as_deref().map(Path::new));
        let named = named.chain(asked.joints.as_deref()).chain(asked.zenoh_config.as_deref());
        let files = Self::default().files(named).bodies(&asked.body).sources(&asked.sources);
        let files = match asked.poses.as_deref().map(bag_of) {
            Some(Ok(bag)) => files.bag(&bag),
            _ => files,
        };
        match asked.joint_states.as_deref().map(StatesSpec::named) {
            Some(Ok(StatesSpec::File(file))) => files.files([file]),
            Some(Ok(StatesSpec::Bag(bag))) => files.bag(&bag),
            _ => files,
        }
    }

    pub fn files(mut self, paths: impl IntoIterator<Item = impl AsRef<Path>>) -> Self {
        self.0.extend(paths.into_iter().map(|path| path.as_ref().to_owned()));
        self
    }

    pub fn bodies<'a>(self, names: impl IntoIterator<Item = &'a String>) -> Self {
        self.files(names.into_iter().flat_map(Body::files))
    }

    /// The file of a bag, or those of its folder.
    fn bag(self, bag: &BagName) -> Self {
        let within = std::fs::read_dir(&bag.path).into_iter().flatten().flatten().map(|entry| entry.path());
        self.files(within).files([&bag.path])
    }

    /// The files of sources that are named so; an invalid one is reported when it is opened.
    pub fn named(self, sources: &[String]) -> Self {
        let sources: Vec<SourceSpec> = sources.iter().filter_map(|source| source.parse().ok()).collect();
        self.sources(&sources)
    }

    /// The files of `sources`.
    pub fn sources(self, sources: &[SourceSpec]) -> Self {
        sources.iter().fold(self, |files, source| match source {
            SourceSpec::Csv(path) | SourceSpec::Ndjson(path) | SourceSpec::Mcap(path) | SourceSpec::Vendor(path) => {
                files.files([path])
            }
            SourceSpec::Ros2Mcap(bag) => files.bag(bag),
            SourceSpec::LeRobot(dataset) => files.files(dataset.tables()).files([dataset.info()]),
            SourceSpec::Sim(path) => files.files(SimulatedSource::files(path)),
            spec if spec.is_stdin() => files.files(["/dev/stdin"]),
            _ => files,
        })
    }

    /// Checks for every output of the command.
    pub fn outputs(self, force: bool) -> OutputPaths {
        OutputPaths::new(force, self.0)
    }
}
