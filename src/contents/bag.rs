//! What is in a bag of ROS 2, as JSON.

use serde_json::{Value, json};

use crate::recording::{BagSurvey, SurveyedTopic};
use crate::robot::messages::{Float32MultiArray, JointState, Message as _, PointCloud2, TfMessage};
use crate::signal::FrameTime;

/// What runs read messages of the type `kind` as, if they do.
pub fn read_as(kind: &str) -> Option<&'static str> {
    match kind {
        PointCloud2::TYPE | Float32MultiArray::TYPE => Some("frames"),
        JointState::TYPE => Some("joint states"),
        TfMessage::TYPE | "nav_msgs/msg/Odometry" => Some("poses"),
        _ => None,
    }
}

/// `ns` nanoseconds in seconds.
pub fn seconds_of(ns: u64) -> f64 {
    FrameTime::from_ns(i64::try_from(ns).unwrap_or(i64::MAX)).s
}

/// What `survey` found: times in seconds, sizes in bytes.
pub fn bag_as_json(survey: &BagSurvey) -> Value {
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
