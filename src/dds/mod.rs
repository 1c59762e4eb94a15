//! A node of ROS 2 over DDS, with no ROS installed: writers of messages that are bytes already, readers of messages, and what
//! other nodes have.

use std::collections::BTreeSet;
use std::io;
use std::net::Ipv4Addr;
use std::time::{Duration, Instant};

use ros2_client::dds::rustdds::{self, DomainParticipantBuilder, mio1};
use ros2_client::qos::{Durability, History, WhenFull};
use ros2_client::{
    Context, MessageTypeName, Name, NodeName, NodeOptions, Publisher, QosProfile, Subscription, WriteError,
};
use serde::de::DeserializeOwned;
use serde::ser::SerializeTuple as _;
use serde::{Serialize, Serializer};

use crate::error::{Error, Result, failed};

/// The domain's variable, and the highest number that it may have.
const DOMAIN: &str = "ROS_DOMAIN_ID";
const MAX_DOMAIN: u16 = 232;
/// The header of CDR, which the writer adds itself.
const CDR_HEADER_BYTES: usize = 4;
/// Topics that every node has.
const OF_EVERY_NODE: [&str; 2] = ["/parameter_events", "/rosout"];
/// How often discovery is looked at.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// What is promised about delivery, and how many messages are kept for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Delivery {
    /// A message may be lost; the newest `depth` are kept.
    BestEffort {
        /// Messages that are kept.
        depth: usize,
    },
    /// What was lost is sent again, from the last `depth` messages.
    Reliable {
        /// Messages that are kept.
        depth: usize,
    },
}

impl Delivery {
    fn qos(self) -> QosProfile {
        let (profile, depth) = match self {
            Self::BestEffort { depth } => (QosProfile::default().reliability_best_effort(), depth),
            // A reader that has stopped must not hold up the others.
            Self::Reliable { depth } => (QosProfile::default().reliability_reliable(WhenFull::Fail), depth),
        };
        profile.durability(Durability::Volatile).history(History::KeepLast { depth })
    }
}

/// A node, and what it writes and reads.
pub(crate) struct Node {
    node: ros2_client::Node,
    context: Context,
    domain: u16,
}

impl Node {
    /// The node `name` in `namespace`, which is empty or begins with `/`, in the domain that `ROS_DOMAIN_ID` says.
    ///
    /// # Errors
    /// A variable or a name cannot be used; the network cannot.
    pub(crate) fn new(namespace: &str, name: &str) -> Result<Self> {
        let domain = domain(std::env::var(DOMAIN).ok().as_deref())?;
        let builder = DomainParticipantBuilder::new(domain);
        let builder = if is_local(|name| std::env::var(name).ok()) {
            builder.with_only_networks([Ipv4Addr::LOCALHOST])
        } else {
            builder
        };
        let failed = |what: String| failed!("no node in domain {domain}: {what}");
        let participant = builder.build().map_err(|e| failed(e.to_string()))?;
        let context = Context::from_domain_participant(participant).map_err(|e| failed(e.to_string()))?;
        let namespace = if namespace.is_empty() { "/" } else { namespace };
        let name = NodeName::new(namespace, name).map_err(|e| Error::usage(e.to_string()))?;
        let options = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
        let node = context.new_node(name, options).map_err(|e| failed(e.to_string()))?;
        Ok(Self { node, context, domain })
    }

    /// Its domain.
    pub(crate) fn domain(&self) -> u16 {
        self.domain
    }

    fn topic(&self, topic: &str, kind: &str, qos: &QosProfile) -> Result<rustdds::Topic> {
        let name = Name::parse(topic).map_err(|e| Error::usage(format!("`{topic}` is no name of a topic: {e}")))?;
        let (package, kind) = kind.split_once("/msg/").unwrap_or(("", kind));
        let kind = MessageTypeName::new(package, kind);
        self.node.create_topic(&name, kind, qos).map_err(|e| failed!("topic {topic}: {e}"))
    }

    /// A writer of messages of the type `kind`, such as `sensor_msgs/msg/PointCloud2`.
    ///
    /// # Errors
    /// It cannot be made.
    pub(crate) fn writer(&mut self, topic: &str, kind: &str, delivery: Delivery) -> Result<Writer> {
        let qos = delivery.qos();
        let made = self.topic(topic, kind, &qos)?;
        let publisher = self.node.create_publisher(&made, Some(qos)).map_err(|e| failed!("topic {topic}: {e}"))?;
        Ok(Writer { publisher, topic: topic.to_owned() })
    }

    /// A reader of messages of the type `kind`.
    ///
    /// # Errors
    /// It cannot be made.
    pub(crate) fn reader<M: DeserializeOwned + 'static>(
        &mut self,
        topic: &str,
        kind: &str,
        delivery: Delivery,
    ) -> Result<Reader<M>> {
        let qos = delivery.qos();
        let made = self.topic(topic, kind, &qos)?;
        let failed = |what: String| failed!("topic {topic}: {what}");
        let mut subscription = self.node.create_subscription(&made, Some(qos)).map_err(|e| failed(e.to_string()))?;
        let poll = mio1::Poll::new().map_err(|e| failed(e.to_string()))?;
        poll.registry()
            .register(&mut subscription, mio1::Token(0), mio1::Interest::READABLE)
            .map_err(|e| failed(e.to_string()))?;
        Ok(Reader { subscription, poll, events: mio1::Events::with_capacity(8), topic: topic.to_owned() })
    }

    /// The types that others have at `topic`, as soon as there are any, or after `within`.
    pub(crate) fn types_at(&self, topic: &str, within: Duration) -> Vec<String> {
        let begin = Instant::now();
        loop {
            let found: Vec<String> =
                self.topics().into_iter().filter(|(name, _)| name == topic).map(|(_, kind)| kind).collect();
            if !found.is_empty() || begin.elapsed() >= within {
                return found;
            }
            std::thread::sleep(LOOK_EVERY);
        }
    }

    /// All topics of others that are known so far, with their types; without those that each node has.
    pub(crate) fn topics(&self) -> Vec<(String, String)> {
        let own = self.context.discovered_topics();
        let named = own.iter().filter_map(|topic| Some((ros_topic(&topic.name)?, ros_type(&topic.type_name)?)));
        let named: BTreeSet<_> = named.filter(|(name, _)| !OF_EVERY_NODE.contains(&name.as_str())).collect();
        named.into_iter().collect()
    }
}

/// The topic that DDS calls `name`; `None` where it is none of ROS's.
fn ros_topic(name: &str) -> Option<String> {
    name.strip_prefix("rt/").map(|name| format!("/{name}"))
}

/// The type that DDS calls `name`.
fn ros_type(name: &str) -> Option<String> {
    let (package, kind) = name.split_once("::msg::dds_::")?;
    Some(format!("{package}/msg/{}", kind.strip_suffix('_')?))
}

/// The domain that `ROS_DOMAIN_ID` says, 0 where it is not set.
fn domain(text: Option<&str>) -> Result<u16> {
    let Some(text) = text.map(str::trim).filter(|text| !text.is_empty()) else { return Ok(0) };
    text.parse().ok().filter(|domain| *domain <= MAX_DOMAIN).ok_or_else(|| {
        Error::usage(format!("{DOMAIN} is `{text}`; set it to a whole number from 0 to {MAX_DOMAIN}, or leave it out"))
    })
}

/// Whether the environment keeps ROS 2 on this computer.
fn is_local(variable: impl Fn(&str) -> Option<String>) -> bool {
    variable("ROS_AUTOMATIC_DISCOVERY_RANGE").is_some_and(|range| range == "LOCALHOST")
        || variable("ROS_LOCALHOST_ONLY").is_some_and(|only| only == "1")
}

/// A message's bytes, without CDR's header.
struct Raw(Vec<u8>);

impl Serialize for Raw {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        // Eight at a time, which stand at multiples of eight: CDR puts nothing between them. Byte by byte takes a third of the
        // time that sending takes.
        let (eights, rest) = self.0[CDR_HEADER_BYTES..].as_chunks::<8>();
        let mut tuple = serializer.serialize_tuple(eights.len() + rest.len())?;
        for eight in eights {
            tuple.serialize_element(&u64::from_le_bytes(*eight))?;
        }
        for byte in rest {
            tuple.serialize_element(byte)?;
        }
        tuple.end()
    }
}

/// Writes messages to a topic.
pub(crate) struct Writer {
    publisher: Publisher<Raw>,
    topic: String,
}

impl Writer {
    /// Sends a message of little-endian CDR with its header. `false` where too many messages have no receipt yet.
    ///
    /// # Errors
    /// It cannot be sent, nor can others.
    pub(crate) fn write(&self, message: Vec<u8>) -> Result<bool> {
        match self.publisher.publish(Raw(message)) {
            Ok(()) => Ok(true),
            Err(WriteError::WouldBlock { .. }) => Ok(false),
            Err(e) => Err(failed!("topic {}: {e}", self.topic)),
        }
    }
}

/// Reads messages from a topic.
pub(crate) struct Reader<M> {
    subscription: Subscription<M>,
    poll: mio1::Poll,
    events: mio1::Events,
    topic: String,
}

impl<M: DeserializeOwned + 'static> Reader<M> {
    /// The next message that has come.
    ///
    /// # Errors
    /// What has come is no such message.
    pub(crate) fn take(&mut self) -> Result<Option<M>> {
        let taken = self.subscription.take().map_err(|e| failed!("topic {}: {e}", self.topic))?;
        Ok(taken.map(|(message, _)| message))
    }

    /// The next message, if one comes within `wait`.
    ///
    /// # Errors
    /// As [`Reader::take`]; the system cannot wait.
    pub(crate) fn next(&mut self, wait: Duration) -> Result<Option<M>> {
        if let Some(message) = self.take()? {
            return Ok(Some(message));
        }
        match self.poll.poll(&mut self.events, Some(wait)) {
            Err(e) if e.kind() != io::ErrorKind::Interrupted => Err(failed!("topic {}: {e}", self.topic)),
            _ => self.take(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_dds_are_those_of_ros() {
        assert_eq!(ros_topic("rt/arm/skin").as_deref(), Some("/arm/skin"));
        assert_eq!(ros_topic("rq/arm/getRequest"), None);
        assert_eq!(ros_type("sensor_msgs::msg::dds_::PointCloud2_").as_deref(), Some("sensor_msgs/msg/PointCloud2"));
        assert_eq!(ros_type("rcl_interfaces::srv::dds_::Get_"), None);
    }

    #[test]
    fn the_environment_says_domain_and_range() {
        assert_eq!([None, Some(""), Some(" 42 "), Some("232")].map(|text| domain(text).unwrap()), [0, 0, 42, 232]);
        for text in ["233", "-1", "a", "1.5"] {
            let error = domain(Some(text)).unwrap_err();
            assert!(error.is_usage() && error.to_string().contains("ROS_DOMAIN_ID"), "{error}");
        }
        let with =
            |set: &'static str, value: &'static str| is_local(move |name| (name == set).then(|| value.to_owned()));
        assert!(with("ROS_LOCALHOST_ONLY", "1") && with("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"));
        assert!(!with("ROS_LOCALHOST_ONLY", "0") && !with("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET"));
    }
}
