//! What is in a bag of ROS 2, for people.

use somatic::internal::contents::{read_as, seconds_of};
use somatic::internal::recording::BagSurvey;

use super::super::table::{plain, shown};
use super::super::words::{count, number, size_words, span, title};

pub(super) fn text(name: &str, survey: &BagSurvey) -> String {
    let spans = survey.topics.iter().filter_map(|topic| topic.span_ns);
    let whole = spans.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
    let mut text = format!("{}\n", title(name));
    let files = count(survey.files as u64, "file");
    text += &format!("  {:<12}bag of ROS 2, {files}, {}\n", "kind", size_words(survey.bytes));
    if let Some([first_ns, last_ns]) = whole {
        let duration_s = (last_ns - first_ns) as f64 / 1e9;
        text += &format!(
            "  {:<12}{} ({duration_s} s from {} s, by when messages came)\n",
            "duration",
            span(duration_s),
            seconds_of(first_ns)
        );
    }
    let mut table = plain(["topic", "type", "messages", "Hz", "read as"], 2..4);
    for topic in &survey.topics {
        table.add_row([
            topic.name.clone(),
            topic.kind.clone(),
            topic.messages.to_string(),
            topic.rate_hz().map_or(String::new(), number),
            read_as(&topic.kind).unwrap_or_default().to_owned(),
        ]);
    }
    text += "\n";
    text += &shown(&table);
    text
}
