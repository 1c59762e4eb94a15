//! What is in a bag of ROS 2, for people and machines.

use serde_json::{Value, json};
use somatic::FrameTime;
use somatic::internal::recording::{BagSurvey, SurveyedTopic};
use somatic::internal::robot::messages::{Float32MultiArray, JointState, Message as _, PointCloud2};

use super::super::table::{plain, shown};
use super::super::words::{count, number, size_words, span, title};

/// What runs read messages of the type `kind` as, if they do.
fn read_as(kind: &str) -> Option<&'static str> {
    match kind {
        PointCloud2::TYPE | Float32MultiArray::TYPE => Some("frames"),
        JointState::TYPE => Some("joint states"),
        _ => None,
    }
}

/// `ns` nanoseconds in seconds.
fn seconds_of(ns: u64) -> f64 {
    FrameTime::from_ns(i64::try_from(ns).unwrap_or(i64::MAX)).s
}

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

pub(super) fn as_json(survey: &BagSurvey) -> Value {
    let BagSurvey { files, bytes, topics, losses } = survey;
    let topic = |topic: &SurveyedTopic| {
        json!({
            "topic": topic.name, "type": topic.kind, "encoding": topic.encoding, "messages": topic.messages,
            "bytes": topic.bytes, "start": topic.span_ns.map(|span| seconds_of(span[0])),
            "end": topic.span_ns.map(|span| seconds_of(span[1])),
            "rate_hz": topic.rate_hz(), "read_as": read_as(&topic.kind),
        })
    };
    let topics: Vec<Value> = topics.iter().map(topic).collect();
    json!({"kind": "bag of ROS 2", "files": files, "bytes": bytes, "topics": topics, "losses": losses})
}
