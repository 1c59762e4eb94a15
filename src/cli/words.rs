//! Numbers as people read them.

use std::borrow::Cow;
use std::time::Duration;

use console::{Alignment, Term, measure_text_width, pad_str, style, truncate_str};
use somatic::internal::plain;
use somatic::{Error, Result};

/// `value` with four significant digits, in at most nine characters.
pub(super) fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        return "0".to_owned();
    }
    if !(1e-3..1e6).contains(&size) {
        return format!("{value:.1e}");
    }
    let decimals = (3 - size.log10().floor() as i32).clamp(0, 5) as usize;
    format!("{value:.decimals$}")
}

/// Percentiles of areas over their median, as text: `0.91–1.08`.
pub(super) fn spread([low, high]: [f64; 2]) -> String {
    format!("{low:.2}–{high:.2}")
}

/// `metres` in millimetres, in at most six characters while that is under a kilometre.
pub(super) fn millimetres(metres: f64) -> String {
    let mm = metres * 1e3;
    let text = match mm.abs() {
        size if size < 999.95 => format!("{mm:.1}"),
        size if size < 99999.5 => format!("{mm:.0}"),
        _ => format!("{mm:.0e}"),
    };
    // Minus nothing is nothing.
    if text == "-0.0" { "0.0".to_owned() } else { text }
}

/// `count` things: `1 frame`, `2 frames`.
pub(super) fn count(count: u64, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}

/// `bytes` as people say them.
pub(super) fn size_words(bytes: u64) -> String {
    match bytes as f64 {
        size if size < 1e3 => format!("{size} B"),
        size if size < 1e6 => format!("{:.1} kB", size / 1e3),
        size if size < 1e9 => format!("{:.1} MB", size / 1e6),
        size => format!("{:.1} GB", size / 1e9),
    }
}

/// A time span as short as it can be understood.
pub(super) fn span(seconds: f64) -> String {
    match seconds {
        0.0 => "0 s".to_owned(),
        s if s < 1e-3 => format!("{:.0} µs", s * 1e6),
        s if s < 0.9995 => format!("{:.0} ms", s * 1e3),
        s if s < 10.0 => format!("{s:.1} s"),
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

/// `2s`, `500ms`, `10min`, as `--for` has them.
pub(super) fn seconds(text: &str) -> Result<Duration> {
    let unit = |suffix: &str, factor: f64| Some(text.strip_suffix(suffix)?.trim().parse::<f64>().ok()? * factor);
    let span = unit("ms", 1e-3).or_else(|| unit("min", 60.0)).or_else(|| unit("s", 1.0));
    span.and_then(|s| Duration::try_from_secs_f64(s).ok())
        .ok_or_else(|| Error::usage(format!("--for `{text}` is not a time; write 2s, 500ms or 10min")))
}

/// `text` as people can read it on one line, whatever is in it.
pub(super) fn one_line(text: &str) -> Cow<'_, str> {
    plain::line(text)
}

/// `name` above what there is to say about it.
pub(super) fn title(name: &str) -> String {
    style(one_line(name)).bold().to_string()
}

/// A line of a list for people: a mark, and `text` between words onto as many lines as a terminal needs.
pub(super) fn bullet(text: &str) -> String {
    let term = Term::stdout();
    let width = if term.is_term() { usize::from(term.size().1).max(40) } else { usize::MAX };
    let mut lines = format!("  {} ", style("•").yellow());
    let mut used = 4;
    let text = one_line(text);
    for (index, word) in text.split(' ').enumerate() {
        let wide = measure_text_width(word);
        if index > 0 && used + 1 + wide > width {
            lines += "\n    ";
            used = 4;
        } else if index > 0 {
            lines += " ";
            used += 1;
        }
        lines += word;
        used += wide;
    }
    lines + "\n"
}

/// `text` in exactly `width` columns. What does not fit loses its start, as the end of a name tells most.
pub(super) fn fitted(text: &str, width: usize, right: bool) -> String {
    if width == 0 {
        return String::new();
    }
    let (mut shown, mut rest) = (text.to_owned(), text.chars());
    while measure_text_width(&shown) > width && rest.next().is_some() {
        shown = format!("…{}", rest.as_str());
    }
    pad_str(&shown, width, if right { Alignment::Right } else { Alignment::Left }, None).into_owned()
}

/// As much of the start of `text` as `width` columns show.
pub(super) fn clipped(text: &str, width: usize) -> String {
    truncate_str(text, width, if width == 0 { "" } else { "…" }).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_keep_four_digits() {
        let texts = [0.0, 1.0, 0.0123456, -12.345, 123456.0, 999_999.9, 1e9, -1e-30].map(number);
        assert_eq!(texts, ["0", "1.000", "0.01235", "-12.35", "123456", "1000000", "1.0e9", "-1.0e-30"]);
        assert_eq!(
            [0.0123, -0.00001, -0.9999, 12.0, -99.0].map(millimetres),
            ["12.3", "0.0", "-999.9", "12000", "-99000"]
        );
    }

    #[test]
    fn text_is_fitted_by_what_a_terminal_shows() {
        assert_eq!(fitted("palm", 6, false), "palm  ");
        assert_eq!(fitted("12", 4, true), "  12");
        assert_eq!(fitted("hand/palm", 6, false), "…/palm");
        assert_eq!(fitted("掌掌掌", 4, false), "…掌 ");
        assert_eq!(fitted("palm", 0, false), "");
        assert_eq!(["palm", "fingers"].map(|text| clipped(text, 5)), ["palm", "fing…"]);
        assert_eq!((clipped("掌掌掌", 4), clipped("palm", 0)), ("掌…".into(), String::new()));
    }

    #[test]
    fn spans_and_counts_read_well() {
        assert_eq!(
            [0.0, 0.000_05, 0.026, 0.9999, 59.6, 130.0, 9000.0].map(span),
            ["0 s", "50 µs", "26 ms", "1.0 s", "60 s", "2 min", "2.5 h"]
        );
        assert_eq!((count(1, "frame"), count(0, "frame")), ("1 frame".into(), "0 frames".into()));
    }
}
