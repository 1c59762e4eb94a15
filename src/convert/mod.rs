//! Frames from one kind of file to another, and skins: for `somatic convert`, and for Python.

mod frames;
mod skin;

pub use self::frames::{Copied, FrameFile};
pub use self::skin::{SkinFormat, is_body};
