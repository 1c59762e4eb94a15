//! Messages of any type, by their definition.

mod definition;
mod plan;
mod reading;
mod walk;

pub(super) use self::definition::is_usual;
pub(super) use self::plan::{Plan, not_defined};
pub(super) use self::reading::MessageReading;
