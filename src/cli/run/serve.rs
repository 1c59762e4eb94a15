//! Hands frames and percepts to sinks.

use somatic::sink::{Flow, InputFrames, Session, Sink, SinkTarget};
use somatic::{Percepts, Result};

use crate::cli::stdio::say;

/// Opens all of `targets`, and says what they will not hold, unless `quiet`.
pub(super) fn opened(
    targets: Vec<SinkTarget>,
    session: &Session<'_>,
    quiet: bool,
) -> Result<Vec<Box<dyn Sink + Send>>> {
    let sinks = targets.into_iter().map(|target| target.open(session)).collect::<Result<Vec<_>>>()?;
    if !quiet {
        sinks.iter().flat_map(|sink| sink.remarks()).for_each(|remark| say(&remark));
    }
    Ok(sinks)
}

/// Does something with each sink that somebody reads. While somebody waits for every frame, a sink that fails is told and
/// left out, and the others go on; the last one that fails is an error.
pub(super) fn serve(
    sinks: &mut Vec<Box<dyn Sink + Send>>,
    live: bool,
    failed: &mut bool,
    mut act: impl FnMut(&mut dyn Sink) -> Result<Flow>,
) -> Result<()> {
    let mut index = 0;
    while index < sinks.len() {
        match act(&mut *sinks[index]) {
            Ok(Flow::Open) => index += 1,
            Ok(Flow::Closed) => sinks.remove(index).finish()?,
            Err(error) if live && sinks.len() > 1 => {
                say(&format!("{error}; continuing without it"));
                *failed = true;
                drop(sinks.remove(index));
            }
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

pub(super) fn give(sink: &mut dyn Sink, input: &InputFrames<'_>, percepts: &Percepts, flush: bool) -> Result<Flow> {
    for flow in [sink.write_input(input)?, sink.write(percepts)?] {
        if flow == Flow::Closed {
            return Ok(flow);
        }
    }
    if flush { sink.flush() } else { Ok(Flow::Open) }
}

/// Gives a sink percepts that limbs have computed.
pub(super) fn give_lines(sink: &mut dyn Sink, lines: &[String]) -> Result<Flow> {
    match sink.write_percepts_of_limbs(lines)? {
        Flow::Open => sink.flush(),
        Flow::Closed => Ok(Flow::Closed),
    }
}
