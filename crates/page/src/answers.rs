//! What viewers are answered where nobody plays: frames come as they come.

use super::encode::History;
use super::exchange::Payload;
use super::message::Request;
use super::text;

/// The answer to `request`, if there is one; `is_over` says that no more frames come.
pub(super) fn answer_without_player(request: &Request, is_over: bool) -> Option<Payload> {
    Some(match request {
        Request::Left => return None,
        Request::Explain { field } => {
            let why = "frames come as they come; record the run and open the recording with `somatic view`";
            Payload::Text(text::no_explanation(*field, why))
        }
        Request::History { id, from_s, to_s, bins, series } => {
            let nothing = [vec![f32::NAN; *bins], vec![f32::NAN; *bins]];
            let series = vec![nothing; series.len()];
            Payload::Binary(History { id: *id, from_s: *from_s, to_s: *to_s, bins: *bins, series }.message())
        }
        _ => Payload::Text(text::live_status(is_over)),
    })
}
