//! Whether percepts can be compared with the reference.

use somatic::{Engine, Error, Result};

use super::stdio::say;

/// Whether there is another backend than the reference to compare with it: an error where the reference was asked for, and
/// said where a measurement chose it.
pub(super) fn has_another_to_compare(engine: &Engine, chosen: Option<&str>) -> Result<bool> {
    if engine.backend().name != "reference" {
        return Ok(true);
    }
    if chosen.is_none() {
        return Err(Error::usage(
            "--verify would compare the reference with itself; use backend cpu or gpu in single precision, or leave \
             --verify out",
        ));
    }
    say("nothing to verify: the reference itself was chosen");
    Ok(false)
}
