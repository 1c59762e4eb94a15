//! Times as recordings print them.

use crate::error::{Result, failed};

/// The time since the first frame, from times of the day.
#[derive(Default)]
pub(super) struct OfDay {
    first_s: Option<f64>,
    last_s: f64,
    days: f64,
}

const DAY_S: f64 = 86_400.0;

impl OfDay {
    /// How long after the first one `text` is, s, which is a time of the day such as `08:21:17.982` or `6:21:52.34 PM`.
    pub(super) fn since_first(&mut self, text: &str) -> Result<f64> {
        let day_s =
            seconds_of_day(text).ok_or_else(|| failed!("`{text}` is not a time of the day such as 08:21:17.982"))?;
        let first_s = *self.first_s.get_or_insert(day_s);
        // Past midnight, rather than time that goes back.
        if day_s < self.last_s - DAY_S / 2.0 {
            self.days += 1.0;
        }
        self.last_s = day_s;
        // As decimal numbers, so that a difference of milliseconds is one.
        Ok((((day_s - first_s) + self.days * DAY_S) * 1e6).round() / 1e6)
    }
}

fn seconds_of_day(text: &str) -> Option<f64> {
    let text = text.trim().to_ascii_uppercase();
    let (text, half) = match (text.strip_suffix("AM"), text.strip_suffix("PM")) {
        (Some(text), _) => (text.trim(), Some(0.0)),
        (_, Some(text)) => (text.trim(), Some(12.0)),
        _ => (text.as_str(), None),
    };
    let mut parts = text.split(':').map(|part| part.trim().replace(',', ".").parse::<f64>().ok());
    let (hours, minutes, seconds) = (parts.next()??, parts.next()??, parts.next()??);
    let hours = half.map_or(hours, |half| hours % 12.0 + half);
    let fits = (0.0..24.0).contains(&hours) && (0.0..60.0).contains(&minutes) && (0.0..61.0).contains(&seconds);
    (fits && parts.next().is_none()).then_some(hours * 3600.0 + minutes * 60.0 + seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_the_day_are_seconds_since_the_first() {
        let mut time = OfDay::default();
        for (text, t_s) in [
            ("08:21:17.982", 0.0),
            ("08:21:17,998", 0.016),
            (" 8:21:18 AM", 0.018),
            ("11:59:59.982 pm", 56_322.0),
            ("00:00:00.982", 56_323.0),
        ] {
            assert_eq!(time.since_first(text).unwrap(), t_s, "{text}");
        }
        // A second back is that, and no day further.
        assert_eq!(time.since_first("00:00:00").unwrap(), 56_322.018);
    }

    #[test]
    fn what_is_no_time_is_refused() {
        for text in ["", "8:21", "25:00:00", "8:61:00", "a:b:c", "1:2:3:4", "nan:0:0"] {
            assert!(OfDay::default().since_first(text).is_err(), "{text}");
        }
    }
}
