//! Messages of any type, by their definition.

mod definition;
mod plan;
mod walk;

pub(super) use self::definition::is_usual;
pub(super) use self::plan::{Plan, TimePlace, not_defined};
pub(super) use self::walk::{Stamp, Taken, Trouble};
