//! Reads a file for what stands after its first frame, and is to be known before it.

use std::path::Path;

use super::footscan::Feet;
use super::lines::Lines;
use super::novel_places::Places;
use super::parser::{Parser as _, Rate};
use super::stappone::Soles;
use super::text::Separator;
use super::xsensor::Xsensor;
use super::xsensor_groups::Groups;
use crate::error::{Error, Result};
use crate::signal::Frame;

/// The places of pliance's sensors, which stand at the end.
pub(super) fn places(path: &Path) -> Result<Option<Places>> {
    let mut places = Places::default();
    each_line(path, "pliance's places of sensors follow the pressures", |line| places.line(line))?;
    Ok(places.found())
}

/// The feet of footscan, which stand one after the other.
pub(super) fn feet(path: &Path) -> Result<Feet> {
    let mut feet = Feet::default();
    each_line(path, "footscan's feet follow each other", |line| feet.line(line))?;
    Ok(feet)
}

/// The soles of Stappone.
pub(super) fn soles(path: &Path, separator: Separator) -> Result<Soles> {
    let mut soles = Soles::default();
    each_line(path, "StappOne's soles may follow each other", |line| {
        soles.line(separator, line);
        Ok(())
    })?;
    Ok(soles)
}

/// The groups of XSENSOR, if there are any. They have values without places, and which cells these are of shows in many frames.
/// Stops where the file is not as it should be, which is said when it is read for its frames.
pub(super) fn groups(path: &Path, separator: Separator, rate: Rate) -> Result<Option<Groups>> {
    let mut lines = Lines::open(path)?;
    let (mut reader, mut frame) = (Xsensor::new(separator, rate, None).collecting(), Frame::missing(0.0, 0));
    while let Some(line) = lines.next()? {
        match reader.line(line, &mut frame) {
            Ok(true) if !reader.has_groups() => return Ok(None),
            Ok(_) => {}
            Err(_) if reader.go_on() => {}
            Err(_) => break,
        }
    }
    // What a last frame lacks is said later, too.
    let _ = reader.end(&mut frame);
    Ok(reader.into_groups())
}

/// Gives each line of the file at `path` to `take`; `why` it is read twice.
fn each_line(path: &Path, why: &str, mut take: impl FnMut(&[u8]) -> Result<()>) -> Result<()> {
    if !path.is_file() {
        return Err(Error::failed(format!("{why}, so the file is read twice, and a pipe cannot be; save it first")));
    }
    let mut lines = Lines::open(path)?;
    while let Some(line) = lines.next()? {
        if let Err(error) = take(line) {
            return Err(error.at(format!("line {}", lines.number())));
        }
    }
    Ok(())
}
