//! What the page says: messages of text, parsed and checked. A wrong key or value is an error, which ends the connection.

use serde::Deserialize;

use super::series::Series;
use somatic_engine::percept::Column;

/// The version of the protocol.
pub(super) const VERSION: u32 = 5;
/// The most bytes of a message.
pub(super) const MAX_MESSAGE_BYTES: usize = 64 << 10;
/// The most series of a viewer.
const MAX_SERIES: usize = 16;
/// The most bins of a history.
const MAX_BINS: usize = 4096;
/// The most frames of a step.
const MAX_STEP: i32 = 1000;

/// What counts in a message refer to.
#[derive(Clone, Debug, Default)]
pub(super) struct Counts {
    pub(super) taxels: usize,
    pub(super) fields: usize,
    /// The run's outputs, in the order of the columns of `welcome`.
    pub(super) columns: Vec<&'static Column>,
}

/// A message that holds what it may.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Message {
    Hello { token: String, after_event: Option<u64> },
    Drawn { seq: u32 },
    Columns(u64),
    Series(Vec<Series>),
    Taxel(Option<usize>),
    Request(Request),
}

/// What a viewer asks of whoever plays.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Request {
    /// A viewer is there: it has been sent the scene, and waits for `status` and `timeline`.
    Joined,
    /// A viewer has gone.
    Left,
    /// Go on.
    Play,
    /// Stop where it is.
    Pause,
    /// Show the last frame at or before this time, s.
    Seek {
        /// The time, s.
        t_s: f64,
    },
    /// Stop, and move by this number of frames.
    Step {
        /// Number of frames, negative for earlier ones.
        frames: i32,
    },
    /// Stop, and show this frame of the recording, or its last one.
    Show {
        /// Its number, from 0.
        frame: u64,
    },
    /// Play at this many times the recorded speed.
    Speed {
        /// The factor, 0.01 to 100.
        speed: f64,
    },
    /// Explain the percept of a field.
    Explain {
        /// The field, as [`Percept::field`](somatic_engine::percept::Percept::field) counts.
        field: usize,
    },
    /// Send the least and most of each series in each of some bins.
    History {
        /// The viewer's number for the answer.
        id: u32,
        /// Begin of the first bin, s.
        from_s: f64,
        /// End of the last bin, s.
        to_s: f64,
        /// Number of bins, 1 to 4096.
        bins: usize,
        /// The series.
        series: Vec<Series>,
    },
    /// Send the highest pressure of each taxel in the frames that are shown from one time to another.
    Peaks {
        /// The viewer's number for the answer.
        id: u32,
        /// Begin, s.
        from_s: f64,
        /// End, s.
        to_s: f64,
    },
}

#[derive(Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
enum Raw {
    Hello { version: u32, token: String, after_event: Option<u64> },
    Drawn { seq: u32 },
    Columns { columns: Vec<String> },
    Series { series: Vec<RawSeries> },
    // Without fields they would take any keys.
    Play {},
    Pause {},
    Seek { t_s: f64 },
    Step { frames: i32 },
    Show { frame: u64 },
    Speed { speed: f64 },
    Taxel { taxel: Option<usize> },
    Explain { field: usize },
    History { id: u32, from_s: f64, to_s: f64, bins: usize, series: Vec<RawSeries> },
    Peaks { id: u32, from_s: f64, to_s: f64 },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSeries {
    field: usize,
    column: String,
    component: usize,
}

/// The message in `text`, of a page that shows what `counts` counts.
///
/// # Errors
/// It is not a message, or refers to what is not there; a reason of at most 123 bytes.
pub(super) fn parse(text: &str, counts: &Counts) -> Result<Message, String> {
    if text.len() > MAX_MESSAGE_BYTES {
        return Err("a message is over 64 KiB".to_owned());
    }
    let raw: Raw = serde_json::from_str(text).map_err(|e| short(&format!("not a message: {e}")))?;
    Ok(match raw {
        Raw::Hello { version: VERSION, token, after_event } => Message::Hello { token, after_event },
        Raw::Hello { version, .. } => {
            return Err(format!("the page speaks version {version}, the server {VERSION}; load the page again"));
        }
        Raw::Drawn { seq } => Message::Drawn { seq },
        Raw::Columns { columns } => {
            let bit = |name: &String| counts.index_of(name).map(|index| 1 << index);
            Message::Columns(columns.iter().map(bit).try_fold(0, |bits, bit| Ok::<u64, String>(bits | bit?))?)
        }
        Raw::Series { series } => Message::Series(counts.series(series)?),
        Raw::Taxel { taxel } => Message::Taxel(taxel.map(|taxel| below(taxel, counts.taxels, "taxel")).transpose()?),
        Raw::Play {} => Message::Request(Request::Play),
        Raw::Pause {} => Message::Request(Request::Pause),
        Raw::Seek { t_s } if t_s.is_finite() => Message::Request(Request::Seek { t_s }),
        Raw::Step { frames } if (-MAX_STEP..=MAX_STEP).contains(&frames) => Message::Request(Request::Step { frames }),
        Raw::Show { frame } => Message::Request(Request::Show { frame }),
        Raw::Speed { speed } if (0.01..=100.0).contains(&speed) => Message::Request(Request::Speed { speed }),
        Raw::Explain { field } => Message::Request(Request::Explain { field: below(field, counts.fields, "field")? }),
        Raw::History { id, from_s, to_s, bins, series }
            if from_s.is_finite() && to_s.is_finite() && from_s < to_s && (1..=MAX_BINS).contains(&bins) =>
        {
            let series = counts.series(series)?;
            Message::Request(Request::History { id, from_s, to_s, bins, series })
        }
        Raw::Peaks { id, from_s, to_s } if from_s.is_finite() && to_s.is_finite() && from_s <= to_s => {
            Message::Request(Request::Peaks { id, from_s, to_s })
        }
        Raw::Seek { .. } | Raw::Step { .. } | Raw::Speed { .. } | Raw::History { .. } | Raw::Peaks { .. } => {
            return Err("a number in a message is out of range".to_owned());
        }
    })
}

impl Counts {
    fn index_of(&self, name: &str) -> Result<usize, String> {
        let index = self.columns.iter().position(|column| column.name == name);
        index.ok_or_else(|| short(&format!("there is no column `{name}`")))
    }

    fn series(&self, raw: Vec<RawSeries>) -> Result<Vec<Series>, String> {
        if raw.len() > MAX_SERIES {
            return Err(format!("there are at most {MAX_SERIES} series"));
        }
        let series = |raw: RawSeries| {
            let column = self.columns[self.index_of(&raw.column)?];
            let component = below(raw.component, column.components, "component")?;
            Ok(Series { field: below(raw.field, self.fields, "field")?, column, component })
        };
        raw.into_iter().map(series).collect()
    }
}

fn below(index: usize, count: usize, what: &str) -> Result<usize, String> {
    if index < count { Ok(index) } else { Err(format!("there is no {what} {index}")) }
}

/// As much of `reason` as a close frame holds.
fn short(reason: &str) -> String {
    let mut end = reason.len().min(123);
    while !reason.is_char_boundary(end) {
        end -= 1;
    }
    reason[..end].to_owned()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use somatic_engine::percept::COLUMNS;

    fn counts() -> Counts {
        Counts { taxels: 4, fields: 3, columns: COLUMNS.iter().take(8).collect() }
    }

    fn parsed(text: &str) -> Result<Message, String> {
        parse(text, &counts())
    }

    #[test]
    fn messages_are_read() {
        let series = Series { field: 2, column: &COLUMNS[4], component: 1 };
        for (text, message) in [
            (
                r#"{"type":"hello","version":5,"token":"ab","after_event":null}"#,
                Message::Hello { token: "ab".to_owned(), after_event: None },
            ),
            (
                r#"{"after_event":7,"token":"","version":5,"type":"hello"}"#,
                Message::Hello { token: String::new(), after_event: Some(7) },
            ),
            (r#"{"type":"drawn","seq":5}"#, Message::Drawn { seq: 5 }),
            (r#"{"type":"columns","columns":["total","peak","centroid"]}"#, Message::Columns(0b10011)),
            (
                r#"{"type":"series","series":[{"field":2,"column":"centroid","component":1}]}"#,
                Message::Series(vec![series]),
            ),
            (r#"{"type":"taxel","taxel":3}"#, Message::Taxel(Some(3))),
            (r#"{"type":"taxel","taxel":null}"#, Message::Taxel(None)),
            (r#"{"type":"play"}"#, Message::Request(Request::Play)),
            (r#"{"type":"seek","t_s":-1.5}"#, Message::Request(Request::Seek { t_s: -1.5 })),
            (r#"{"type":"step","frames":-1000}"#, Message::Request(Request::Step { frames: -1000 })),
            (r#"{"type":"show","frame":12}"#, Message::Request(Request::Show { frame: 12 })),
            (r#"{"type":"speed","speed":0.25}"#, Message::Request(Request::Speed { speed: 0.25 })),
            (r#"{"type":"explain","field":0}"#, Message::Request(Request::Explain { field: 0 })),
            (
                r#"{"type":"history","id":1,"from_s":0,"to_s":2,"bins":4096,"series":[]}"#,
                Message::Request(Request::History { id: 1, from_s: 0.0, to_s: 2.0, bins: 4096, series: vec![] }),
            ),
            (
                r#"{"type":"peaks","id":2,"from_s":0.5,"to_s":0.5}"#,
                Message::Request(Request::Peaks { id: 2, from_s: 0.5, to_s: 0.5 }),
            ),
        ] {
            assert_eq!(parsed(text), Ok(message), "{text}");
        }
    }

    #[test]
    fn what_is_not_known_is_refused() {
        for text in [
            "",
            "7",
            "[]",
            "{}",
            "{\"type\":\"play\"",
            r#"{"type":"quit"}"#,
            r#"{"type":"play","now":true}"#,
            r#"{"type":"drawn"}"#,
            r#"{"type":"drawn","seq":-1}"#,
            r#"{"type":"drawn","seq":1,"seq":2}"#,
            r#"{"type":"drawn","seq":4294967296}"#,
            r#"{"type":"hello","version":4,"token":"a","after_event":null}"#,
            r#"{"type":"hello","version":5,"token":7,"after_event":null}"#,
            r#"{"type":"columns","columns":["principal_axis","nothing"]}"#,
            r#"{"type":"series","series":[{"field":3,"column":"total","component":0}]}"#,
            r#"{"type":"series","series":[{"field":0,"column":"total","component":1}]}"#,
            r#"{"type":"series","series":[{"field":0,"column":"total","component":0,"x":0}]}"#,
            r#"{"type":"taxel","taxel":4}"#,
            r#"{"type":"explain","field":3}"#,
            r#"{"type":"seek","t_s":1e999}"#,
            r#"{"type":"step","frames":1001}"#,
            r#"{"type":"show","frame":-1}"#,
            r#"{"type":"speed","speed":0}"#,
            r#"{"type":"history","id":1,"from_s":0,"to_s":0,"bins":1,"series":[]}"#,
            r#"{"type":"history","id":1,"from_s":0,"to_s":1,"bins":4097,"series":[]}"#,
            r#"{"type":"peaks","id":1,"from_s":1,"to_s":0}"#,
            r#"{"type":"peaks","id":1,"from_s":0}"#,
        ] {
            let reason = parsed(text).expect_err(text);
            assert!(!reason.is_empty() && reason.len() <= 123, "{text}: {reason}");
        }
        let one = r#"{"field":0,"column":"total","component":0}"#;
        let many = |count: usize| format!(r#"{{"type":"series","series":[{}]}}"#, vec![one; count].join(","));
        assert!(parsed(&many(16)).is_ok() && parsed(&many(17)).is_err());
        let long = format!(r#"{{"type":"hello","version":5,"token":"{}"}}"#, "é".repeat(MAX_MESSAGE_BYTES / 2));
        assert!(parsed(&long).is_err());
        assert!(parsed(&"[".repeat(60_000)).is_err());
    }

    /// Text that is nearly a message.
    fn nearly() -> impl Strategy<Value = String> {
        let word = prop::sample::select(vec![
            "\"type\"",
            "\"hello\"",
            "\"drawn\"",
            "\"columns\"",
            "\"series\"",
            "\"play\"",
            "\"seek\"",
            "\"t_s\"",
            "\"seq\"",
            "\"history\"",
            "\"id\"",
            "\"bins\"",
            "\"from_s\"",
            "\"field\"",
            "\"token\"",
            "\"total\"",
            "null",
            "true",
            "0",
            "-1",
            "1e308",
            "1e-400",
            "18446744073709551616",
            "{",
            "}",
            "[",
            "]",
            ":",
            ",",
            "\"",
            "\\u0000",
            "\u{fffd}",
            " ",
        ]);
        prop_oneof![
            prop::collection::vec(word, 0..40).prop_map(|words| words.concat()),
            ".{0,80}",
            ("[a-z]{1,9}", "[a-z_]{1,9}", any::<i64>())
                .prop_map(|(kind, key, value)| format!("{{\"type\":\"{kind}\",\"{key}\":{value}}}")),
        ]
    }

    fn is_a_message_or_a_reason(text: &str) -> Result<(), TestCaseError> {
        match parsed(text) {
            Ok(Message::Series(series)) => prop_assert!(series.iter().all(|series| series.field < 3)),
            Ok(_) => {}
            Err(reason) => prop_assert!(!reason.is_empty() && reason.len() <= 123),
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn any_text_is_a_message_or_a_reason(text in nearly()) {
            is_a_message_or_a_reason(&text)?;
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1_000_000))]
        #[test]
        #[ignore = "takes a minute"]
        fn a_million_texts_are_messages_or_reasons(text in nearly()) {
            is_a_message_or_a_reason(&text)?;
        }
    }
}
