//! Outputs: the only code that writes files, and the checks of where it may write.
//!
//! An output that is an input of the same command is an error, even with force; files are identified by inode, through
//! links and other spellings. Two outputs that are one file are an error too. A regular file is replaced only with force.
//! Pipes, terminals and devices are written directly; `-` is standard output, which has room for one output.
//!
//! Most files are written beside and appear when they are whole. Two processes never write one file: the second is refused with
//! the first one's id.
//!
//! A command registers all of its outputs in one [`OutputPaths`] before it starts to work, which creates no file. Writers
//! take an [`OutputPath`]:
//!
//! ```
//! use somatic_skin::output::OutputPath;
//!
//! # fn main() -> somatic_skin::Result<()> {
//! # let folder = tempfile::tempdir().unwrap();
//! # std::env::set_current_dir(&folder).unwrap();
//! let output = OutputPath::new("percepts.ndjson", false, &["touch.csv".as_ref()])?;
//! # drop(output);
//! # Ok(())
//! # }
//! ```

mod destination;
mod file;
mod folder;
#[cfg(unix)]
mod link;
#[cfg(unix)]
mod lock;
mod parts;
mod path;
mod private;

pub use self::private::PrivateFile;
pub use destination::STANDARD_OUTPUT;
pub use destination::refuse_standard_output;
pub use file::{GrowingFile, OutputFile};
pub use folder::OutputFolder;
#[cfg(unix)]
pub use link::OutputLink;
pub use parts::abandon_outputs;
pub use path::{OutputPath, OutputPaths};

#[cfg(test)]
mod tests;
