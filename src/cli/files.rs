//! The files that a command reads: none of its outputs may be one of them.

use std::path::{Path, PathBuf};

use somatic::Body;
use somatic::output::OutputPaths;
use somatic::source::{SimulatedSource, SourceSpec};

use super::scene::RunOptions;

/// Files that a command reads, whether they are there or not.
#[derive(Default)]
pub(super) struct FilesRead(Vec<PathBuf>);

impl FilesRead {
    /// Those of `asked`, by flags or by the scene file at `scene`.
    pub(super) fn of(asked: &RunOptions, scene: Option<&Path>) -> Self {
        let named = scene.into_iter().chain(asked.calibration.as_deref()).chain(asked.wiring.as_deref());
        let named = named.chain(asked.layout.as_deref());
        let named = named.chain(asked.joints.as_deref()).chain(asked.joint_states.as_deref());
        let named = named.chain(asked.zenoh_config.as_deref());
        Self::default().files(named).bodies(&asked.body).sources(&asked.sources)
    }

    pub(super) fn files(mut self, paths: impl IntoIterator<Item = impl AsRef<Path>>) -> Self {
        self.0.extend(paths.into_iter().map(|path| path.as_ref().to_owned()));
        self
    }

    pub(super) fn bodies<'a>(self, names: impl IntoIterator<Item = &'a String>) -> Self {
        self.files(names.into_iter().flat_map(Body::files))
    }

    /// The files of `sources`; an invalid source is reported when it is opened.
    pub(super) fn sources(self, sources: &[String]) -> Self {
        sources.iter().filter_map(|source| source.parse().ok()).fold(self, |files, source| match source {
            SourceSpec::Csv(path) | SourceSpec::Mcap(path) | SourceSpec::Vendor(path) => files.files([path]),
            SourceSpec::Sim(path) => files.files(SimulatedSource::files(path)),
            SourceSpec::Stdin | SourceSpec::CsvStdin => files.files(["/dev/stdin"]),
            _ => files,
        })
    }

    /// Checks for every output of the command.
    pub(super) fn outputs(self, force: bool) -> OutputPaths {
        OutputPaths::new(force, self.0)
    }
}
