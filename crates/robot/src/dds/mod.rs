//! A node of ROS 2 over DDS, with no ROS installed: writers of messages that are bytes already, readers of messages, and what
//! other nodes have.
//!
//! `ros2_client` has the names, the types of ROS's own messages and what promises of delivery mean to DDS. Its writers do not tell
//! which messages have receipts, so writers and readers are those of DDS itself, and the node tells of them.

mod names;
mod reader;
mod writer;

use std::collections::BTreeSet;
use std::net::Ipv4Addr;
use std::time::{Duration, Instant};

use ros2_client::builtin_topics::ros_discovery;
use ros2_client::dds::rustdds::{
    DomainParticipant, DomainParticipantBuilder, Publisher, QosPolicies, QosPolicyBuilder, RTPSEntity as _, Subscriber,
    Topic, TopicKind, no_key,
};
use ros2_client::entities_info::{NodeEntitiesInfo, ParticipantEntitiesInfo};
use ros2_client::qos::{Durability, History, WhenFull};
use ros2_client::{MessageTypeName, Name, NodeName, QosProfile};
use serde::de::DeserializeOwned;

pub(crate) use self::reader::{BytesReader, Reader};
pub use self::writer::Writer;
use crate::error::{Error, Result, failed};

/// Topics that every node has.
const OF_EVERY_NODE: [&str; 2] = ["/parameter_events", "/rosout"];
/// How often discovery is looked at.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// What is promised about delivery, and how many messages are kept for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delivery {
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
    fn qos(self) -> QosPolicies {
        let (profile, depth) = match self {
            Self::BestEffort { depth } => (QosProfile::default().reliability_best_effort(), depth),
            // A reader that has stopped must not hold up the others.
            Self::Reliable { depth } => (QosProfile::default().reliability_reliable(WhenFull::Fail), depth),
        };
        profile.durability(Durability::Volatile).history(History::KeepLast { depth }).into()
    }
}

/// A node, and what it writes and reads.
pub struct Node {
    name: NodeName,
    domain: u16,
    /// What the node has, and where it tells of that.
    has: NodeEntitiesInfo,
    teller: no_key::DataWriterCdr<ParticipantEntitiesInfo>,
    publisher: Publisher,
    subscriber: Subscriber,
    participant: DomainParticipant,
}

impl Node {
    /// The node `name` in `namespace`, which is empty or begins with `/`, in the domain that `ROS_DOMAIN_ID` says.
    ///
    /// # Errors
    /// A variable or a name cannot be used; the network cannot.
    pub fn new(namespace: &str, name: &str) -> Result<Self> {
        let namespace = if namespace.is_empty() { "/" } else { namespace };
        let name = NodeName::new(namespace, name).map_err(|e| Error::usage(e.to_string()))?;
        let domain = names::domain()?;
        let builder = DomainParticipantBuilder::new(domain);
        let builder = if names::is_local() { builder.with_only_networks([Ipv4Addr::LOCALHOST]) } else { builder };
        let failed = |what: String| failed!("no node in domain {domain}: {what}");
        let participant = builder.build().map_err(|e| failed(e.to_string()))?;
        let none = QosPolicyBuilder::new().build();
        let publisher = participant.create_publisher(&none).map_err(|e| failed(e.to_string()))?;
        let subscriber = participant.create_subscriber(&none).map_err(|e| failed(e.to_string()))?;
        let (topic, kind) = (ros_discovery::TOPIC_NAME.to_owned(), ros_discovery::TYPE_NAME.to_owned());
        let teller = participant
            .create_topic(topic, kind, &ros_discovery::QOS_PUB, TopicKind::NoKey)
            .and_then(|topic| publisher.create_datawriter_no_key_cdr(&topic, None))
            .map_err(|e| failed(e.to_string()))?;
        let mut has = NodeEntitiesInfo::new(name.clone());
        has.add_writer(teller.guid().into());
        let node = Self { name, domain, has, teller, publisher, subscriber, participant };
        node.tell(vec![node.has.clone()])?;
        Ok(node)
    }

    /// Its domain.
    pub(crate) fn domain(&self) -> u16 {
        self.domain
    }

    /// Tells other nodes what this one has.
    fn tell(&self, nodes: Vec<NodeEntitiesInfo>) -> Result<()> {
        let info = ParticipantEntitiesInfo::new(self.participant.guid().into(), nodes);
        self.teller.write(info, None).map_err(|e| failed!("topic {}: {e}", ros_discovery::TOPIC_NAME))
    }

    fn topic(&self, topic: &str, kind: &str, qos: &QosPolicies) -> Result<Topic> {
        let name =
            Name::parse(topic).map_err(|e| Error::usage(format!("`{topic}` is not the name of a topic: {e}")))?;
        let (package, kind) = kind.split_once("/msg/").unwrap_or(("", kind));
        let kind = MessageTypeName::new(package, kind).dds_msg_type();
        self.participant
            .create_topic(name.to_dds_name("rt", &self.name, ""), kind, qos, TopicKind::NoKey)
            .map_err(|e| failed!("topic {topic}: {e}"))
    }

    /// A writer of messages of the type `kind`, such as `sensor_msgs/msg/PointCloud2`.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn writer(&mut self, topic: &str, kind: &str, delivery: Delivery) -> Result<Writer> {
        let qos = delivery.qos();
        let made = self.topic(topic, kind, &qos)?;
        let writer =
            self.publisher.create_datawriter_no_key(&made, Some(qos)).map_err(|e| failed!("topic {topic}: {e}"))?;
        self.has.add_writer(writer.guid().into());
        self.tell(vec![self.has.clone()])?;
        Ok(Writer::new(writer, topic))
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
        self.reader_by(topic, kind, delivery)
    }

    /// A reader of messages of the type `kind` as bytes.
    ///
    /// # Errors
    /// It cannot be made.
    pub(crate) fn bytes_reader(&mut self, topic: &str, kind: &str, delivery: Delivery) -> Result<BytesReader> {
        self.reader_by(topic, kind, delivery)
    }

    fn reader_by<M: 'static, A: no_key::DefaultDecoder<M> + 'static>(
        &mut self,
        topic: &str,
        kind: &str,
        delivery: Delivery,
    ) -> Result<Reader<M, A>> {
        let qos = delivery.qos();
        let made = self.topic(topic, kind, &qos)?;
        let reader = self
            .subscriber
            .create_simple_datareader_no_key(&made, Some(qos))
            .map_err(|e| failed!("topic {topic}: {e}"))?;
        self.has.add_reader(reader.guid().into());
        self.tell(vec![self.has.clone()])?;
        Reader::new(reader, topic)
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
        let found = self.participant.discovered_topics();
        let named = found
            .iter()
            .filter_map(|topic| Some((names::ros_topic(topic.topic_name())?, names::ros_type(topic.type_name())?)));
        let named: BTreeSet<_> = named.filter(|(name, _)| !OF_EVERY_NODE.contains(&name.as_str())).collect();
        named.into_iter().collect()
    }
}

impl Drop for Node {
    fn drop(&mut self) {
        // Others forget it anyway, once its participant has gone.
        let _ = self.tell(Vec::new());
    }
}
