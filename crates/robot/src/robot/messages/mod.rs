//! Messages of ROS 2 as bytes, with no ROS installed: structs after the public definitions, in CDR.
//!
//! The table in `types.rs` gives each message its struct, its bytes both ways, and its definition for a bag's schema. A
//! [`Message`] can be a topic's; it has the hash of its type (RIHS01) as a constant.
//!
//! ```
//! use somatic_robot::robot::messages::{Header, JointState, Message};
//!
//! let state = JointState { name: vec!["wrist".to_owned()], position: vec![0.5], ..JointState::default() };
//! assert_eq!(JointState::from_cdr(&state.to_cdr()), Some(state));
//! ```

mod cdr;
mod types;

pub use cdr::{Byte, Cdr, CdrReader, CdrWriter};
pub use types::{
    Color, CompressedImage, DiagnosticArray, DiagnosticStatus, Duration, Float32MultiArray, Header, JointState,
    KeyValue, Marker, MarkerArray, MeshFile, MultiArrayDimension, MultiArrayLayout, Point, PointCloud2, PointField,
    Pose, Quaternion, TfMessage, Time, Transform, TransformStamped, UvCoordinate, Vector3, Wrench, WrenchStamped,
};

/// A message that can be a topic's.
pub trait Message: Cdr {
    /// The type as ROS 2 spells it, such as `sensor_msgs/msg/PointCloud2`.
    const TYPE: &'static str;
    /// The hash of the type's description (REP 2016), `RIHS01_` and 64 digits.
    const HASH: &'static str;

    /// Its bytes, with CDR's header.
    fn to_cdr(&self) -> Vec<u8> {
        let mut writer = CdrWriter::new();
        self.write(&mut writer);
        writer.into_bytes()
    }

    /// The message in `bytes`; `None` where they are none.
    fn from_cdr(bytes: &[u8]) -> Option<Self> {
        Self::read(&mut CdrReader::new(bytes)?)
    }

    /// Its definition and those of all messages that it is made of, as a bag's schema `ros2msg` has them.
    fn definition() -> String {
        let mut all = Vec::new();
        Self::define(&mut all);
        // Its own comes last, and first in the schema.
        let (_, own) = all.pop().unwrap_or_default();
        let line = "=".repeat(80);
        all.into_iter().fold(own, |text, (name, definition)| format!("{text}{line}\nMSG: {name}\n{definition}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_definition_has_all_that_the_message_is_made_of_once() {
        let expected = "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n\
            ================================================================================\nMSG: builtin_interfaces/Time\n\
            int32 sec\nuint32 nanosec\n\
            ================================================================================\nMSG: std_msgs/Header\n\
            builtin_interfaces/Time stamp\nstring frame_id\n\
            ================================================================================\nMSG: geometry_msgs/Vector3\n\
            float64 x\nfloat64 y\nfloat64 z\n\
            ================================================================================\nMSG: geometry_msgs/Wrench\n\
            geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n";
        assert_eq!(WrenchStamped::definition(), expected);
        assert!(PointCloud2::definition().contains("\nuint8[] data\n"));
        assert!(MarkerArray::definition().starts_with("visualization_msgs/Marker[] markers\n"));
    }

    #[test]
    fn messages_come_back_and_damage_gives_another_or_none() {
        let marker = Marker { ns: "hand".to_owned(), id: 3, text: "odd".to_owned(), ..Marker::default() };
        let message = MarkerArray { markers: vec![marker.clone(), Marker { ns: "a".to_owned(), ..marker }] };
        let bytes = message.to_cdr();
        assert_eq!(MarkerArray::from_cdr(&bytes), Some(message.clone()));
        for at in 0..bytes.len() {
            assert_eq!(MarkerArray::from_cdr(&bytes[..at]), None, "cut at {at}");
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x5A;
            let _ = MarkerArray::from_cdr(&damaged);
        }
    }
}
