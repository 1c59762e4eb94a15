//! Arrays within messages: which values of a message are sensors, and frames from these.

mod array_map;
mod axes;
pub(in crate::source) mod body;
mod decoder;
mod json;
mod json_lines;
mod layout;
mod mapped;
pub(in crate::source) mod modbus;
pub(in crate::source) mod path;
#[cfg(feature = "serial")]
pub(in crate::source) mod paxini;
mod presets;
mod sensor_names;
mod taxels;

pub use self::array_map::{ArrayMap, MapTime};
pub use self::decoder::Decoder;
pub use self::json_lines::JsonLines;
pub use self::layout::{Dimension, Lies, order};
pub use self::mapped::{Came, MappedSource, Messages};
pub use self::path::{ArrayPath, Step};
pub use self::sensor_names::named_sensors;
pub(in crate::source) use self::taxels::MappedTaxels;
