//! What a field reports for a frame: quantities that are present or absent with a reason.
//!
//! [`Percepts`] holds a whole batch in columns, in the precision of the backend that made it; [`Percept`] is one field
//! in one frame, copied out for reading. A quantity is `Some` or it is absent, and then [`Flags`] say why; nothing here
//! is ever NaN or infinite.

/// Lets a type that has a column for each [`Component`] in `$parts` be indexed by component.
macro_rules! index_by_component {
    ($name:ty, $column:ty, $parts:tt $(, $parameter:ident)?) => {
        impl$(<$parameter>)? std::ops::Index<$crate::percept::Component> for $name {
            type Output = $column;

            #[inline(always)]
            fn index(&self, part: $crate::percept::Component) -> &$column {
                &self.$parts[part as usize]
            }
        }

        impl$(<$parameter>)? std::ops::IndexMut<$crate::percept::Component> for $name {
            #[inline(always)]
            fn index_mut(&mut self, part: $crate::percept::Component) -> &mut $column {
                &mut self.$parts[part as usize]
            }
        }
    };
}
pub(crate) use index_by_component;

mod batch;
mod cells;
mod columns;
mod contact_kind;
mod export;
mod flags;
mod keep;
mod outputs;
mod presence;
mod self_contacts;
mod touch;
mod touch_columns;
mod touch_trails;
mod typed;

pub use batch::Percepts;
pub use batch::{Components, Values};
pub(crate) use cells::{CellsMut, PlaceCells};
pub use columns::{COLUMNS, Column, Measure, Outputs, Percept, Unit};
pub use columns::{Component, Host, Store};
pub use contact_kind::ContactKind;
pub use export::ColumnValues;
pub use flags::Flags;
pub use self_contacts::{SelfContact, SelfContactSide};
pub use touch::{FieldShare, FitSigma, LinkShare, Touch, TouchFit, TouchFlags, TouchFrame, Wrench};
pub use touch_columns::{TOUCH_COLUMNS, TouchColumn, TouchOutputs};
pub use touch_trails::TouchTrails;

/// The arithmetic that made the numbers, and so the digits worth printing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// IEEE 754 binary32: backends `cpu` and `gpu`.
    F32,
    /// IEEE 754 binary64: backend `reference`.
    F64,
}
