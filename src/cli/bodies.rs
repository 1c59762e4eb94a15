//! Bodies by their names on the command line.

use std::path::Path;

use somatic::error::nearest;
use somatic::{Body, Error, Result, bundled};

/// The body in the file `name`, or the bundled one of that name where there is no such file.
pub(super) fn load_body(name: &str) -> Result<Body> {
    check_body_name(name)?;
    match bundled::body(name) {
        // A link of this name to a serial port is no body.
        Some(bytes) if !Path::new(name).is_file() => Body::from_bytes(name, bytes),
        _ => Body::load(name),
    }
}

/// Refuses a `name` that is neither a file nor a bundled body, but nearly one of those.
pub(super) fn check_body_name(name: &str) -> Result<()> {
    let near = nearest(name, bundled::BODIES).filter(|&near| near != name && !Path::new(name).is_file());
    near.map_or(Ok(()), |near| {
        Err(Error::failed(format!("no such file; did you mean the bundled body `{near}`?")).at(name))
    })
}
