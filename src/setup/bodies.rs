//! Bodies by their names.

use std::collections::HashSet;
use std::path::Path;

use crate::body::Body;
use crate::bundled;
use crate::error::{Error, Result, nearest};
use crate::signal::Channel;
use crate::source::Source;

/// The channels that `source` delivers. `body` must have them all.
pub fn in_body(body: &Body, source: &dyn Source) -> Result<Vec<u32>> {
    let channels: HashSet<u32> = Channel::all_of(body).into_iter().collect();
    match source.taxels().iter().find(|id| !channels.contains(id)) {
        Some(id) => Err(Error::failed(format!(
            "the source has taxel {}, and the body has none of that number; is it for another body?",
            Channel(*id)
        ))
        .at(&body.name)),
        None => Ok(source.taxels().to_vec()),
    }
}

/// The body in the file `name`, or the bundled one of that name where there is no such file.
pub fn load_body(name: &str) -> Result<Body> {
    check_body_name(name)?;
    match bundled::body(name) {
        // A link of this name to a serial port is not a body.
        Some(bytes) if !Path::new(name).is_file() => Body::from_bytes(name, bytes),
        _ => Body::load(name),
    }
}

/// Refuses a `name` that is neither a file nor a bundled body, but nearly one of those.
pub fn check_body_name(name: &str) -> Result<()> {
    let near = nearest(name, bundled::BODIES).filter(|&near| near != name && !Path::new(name).is_file());
    near.map_or(Ok(()), |near| {
        Err(Error::failed(format!("no such file; did you mean the bundled body `{near}`?")).at(name))
    })
}
