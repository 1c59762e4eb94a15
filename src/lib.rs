//! A sense of touch for whole robots: touch frames in, percepts out.

#![deny(missing_docs)]
#![warn(unreachable_pub)]

pub mod author;
pub mod backend;
pub mod body;
pub mod bundled;
mod engine;
pub mod error;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod experiments;
pub mod field;
pub mod percept;
pub mod scene;
pub mod signal;
pub mod sink;
pub mod source;
mod stage;

pub use backend::BackendKind;
pub use backend::agreement::{Agreement, Comparison};
pub use body::Body;
pub use engine::{Engine, Options};
pub use error::{Error, Result};
pub use percept::{Flags, Outputs, Percept, Percepts, Precision, Touch};
pub use scene::{Plan, Scene};
pub use signal::{Calibration, Frame, Pose, RawValue};

use std::io::Write as _;
use std::path::Path;

/// Writes `bytes` at `path`, whole or not at all: to a temporary file beside it, then renamed over it.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(|e| Error::io(folder, &e))?;
    file.write_all(bytes).map_err(|e| Error::io(path, &e))?;
    file.persist(path).map_err(|e| Error::io(path, &e.error))?;
    Ok(())
}
