//! Finds out how lines are written from the first second of them.

mod clock;
mod frames;
mod heard;
mod named;
mod numbers;

pub(super) use self::heard::{Heard, Kind, Known, kind};
use self::named::named;
use self::numbers::numbers;
use super::form::{Form, short};
use crate::error::{Result, failed};

/// How `lines` are written.
///
/// # Errors
/// They hold no numbers, or not what the flags say.
pub(super) fn recognise(lines: &[Heard], known: Known<'_>) -> Result<Form> {
    let whole = &lines[usize::from(known.is_joined && lines.len() > 1)..];
    let kinds: Vec<Kind> = whole.iter().map(|line| kind(&line.text)).collect();
    let votes = |wanted: Kind| kinds.iter().filter(|&&kind| kind == wanted).count();
    let most = [Kind::Numbers, Kind::Pairs, Kind::Json].into_iter().max_by_key(|&kind| votes(kind));
    match most.filter(|&kind| votes(kind) > 0) {
        Some(Kind::Numbers) => numbers(lines, &kinds, known),
        Some(kind) => {
            let lines: Vec<&Heard> =
                whole.iter().zip(&kinds).filter(|(_, own)| **own == kind).map(|(line, _)| line).collect();
            named(&lines, kind == Kind::Json, known)
        }
        None => {
            let first = lines.iter().find(|line| !line.text.is_empty()).map_or("", |line| &line.text);
            Err(failed!("no line holds numbers, such as `512,300,7`; the first one is `{}`", short(first)))
        }
    }
}
