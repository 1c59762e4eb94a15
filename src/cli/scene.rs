//! What commands are asked to do: flags laid over a scene file.

mod flags;
mod in_flags;
mod outputs;
mod run_flags;

use std::path::Path;

use somatic::Result;
use somatic::internal::setup::{Input, Setup, Tell};
use somatic::scene::file::SceneFile;
use somatic::source::SourceSpec;

pub(super) use self::flags::{LIVE, first, grouped, letter, one_of};
pub(super) use self::in_flags::{in_flags, words_of_flags};
pub(super) use self::outputs::{output, outputs_or_usual};
pub(super) use self::run_flags::RunFlags;
use super::stdio::{check_input, say};

impl RunFlags {
    /// What these flags and the scene file at `scene` ask for together; a flag comes before a key.
    pub(super) fn with(&self, scene: Option<&Path>) -> Result<Setup> {
        let file = scene.map(SceneFile::load).transpose()?.unwrap_or_default();
        let laid = self.over(file.clone()).and_then(|laid| laid.check().map(|()| laid));
        let laid = laid.map_err(|error| match scene {
            // Errors in the file alone name its keys.
            Some(path) if file.check().as_ref() == Err(&error) => error.at(path.display()),
            Some(path) => in_flags(error).at(path.display()),
            None => in_flags(error),
        });
        laid.map(set_up)
    }
}

/// What `scene` asks for; messages speak of flags.
pub(super) fn set_up(scene: SceneFile) -> Setup {
    Setup::new(scene, said())
}

/// Prints each line with flags in place of keys.
pub(super) fn said() -> Tell {
    Tell::new(|text| say(&words_of_flags(text)))
}

/// The input that `asked` names, if standard input can be read where it is that.
pub(super) fn input(asked: &Setup) -> Result<Input> {
    let input = Input::named(asked)?;
    if input.spec.as_ref().is_some_and(SourceSpec::is_stdin) {
        check_input()?;
    }
    Ok(input)
}
