//! Sources whose messages hold arrays, by a map.

use crate::error::{Error, Result};
use crate::robot::mapped_bag;
use crate::source::{MappedSource, SourceSpec, VendorOptions};

/// Opens `spec` by the map of `options`.
///
/// # Errors
/// It cannot be read, or has not what the map says; a usage error if a map is not for it.
pub fn open_mapped(spec: &SourceSpec, options: &VendorOptions) -> Result<MappedSource> {
    spec.check_options(options)?;
    let Some(map) = &options.map else { return Err(Error::usage("this source needs --map")) };
    if let SourceSpec::Ros2Mcap(bag) = spec {
        return mapped_bag(bag, map, options.skip_bad);
    }
    #[cfg(feature = "ros2")]
    if let SourceSpec::Ros2 { topic, kind } = spec {
        return crate::robot::mapped_topic(topic, kind.as_deref(), map, options.skip_bad);
    }
    #[cfg(not(feature = "ros2"))]
    if let SourceSpec::Ros2 { topic, .. } = spec {
        let what = "built without the feature `ros2`: cargo install --path . --features ros2";
        return Err(Error::failed(what).at(format!("source `ros2:{topic}`")));
    }
    let lines = spec.open_json(map, options.skip_bad)?;
    lines.ok_or_else(|| Error::usage("lines that come live are read by `somatic run`").at(spec))
}
