//! Outputs: the only code that writes files, and the checks of where it may write.
//!
//! An output that is an input of the same command is an error, even with force; files are identified by inode, through
//! links and other spellings. Two outputs that are one file are an error too. A regular file is replaced only with force.
//! Pipes, terminals and devices are written directly.
//!
//! A command registers all of its outputs in one [`OutputPaths`] before it starts to work, which creates no file. Writers
//! take an [`OutputPath`]:
//!
//! ```
//! use somatic::output::OutputPath;
//! use somatic::sink::{FieldNames, NdjsonSink};
//!
//! # fn main() -> somatic::Result<()> {
//! # let folder = tempfile::tempdir().unwrap();
//! # std::env::set_current_dir(&folder).unwrap();
//! let output = OutputPath::new("percepts.ndjson", false, &["touch.csv".as_ref()])?;
//! let sink = NdjsonSink::to_file(output, &[FieldNames::default()], false)?;
//! # Ok(())
//! # }
//! ```

mod destination;
mod file;
mod folder;
#[cfg(unix)]
mod link;
mod path;
mod private;

pub use self::private::PrivateFile;
pub use file::{GrowingFile, OutputFile};
pub use folder::OutputFolder;
#[cfg(unix)]
pub use link::OutputLink;
pub use path::{OutputPath, OutputPaths};

#[cfg(test)]
mod tests;
