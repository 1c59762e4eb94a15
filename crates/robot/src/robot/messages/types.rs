//! The messages, field by field in the order of their public definitions (those of ROS 2 Jazzy).

use super::Message;
use super::cdr::{Byte, Cdr, CdrReader, CdrWriter};
use crate::signal::FrameTime;

macro_rules! messages {
    ($($(#[$about:meta])* $name:ident = $ros:literal { $($field:ident: $type:ty),+ $(,)? })+) => {
        $($(#[$about])*
        #[derive(Clone, Debug, Default, PartialEq)]
        #[cfg_attr(feature = "ros2", derive(serde::Deserialize))]
        pub struct $name {
            $(#[doc = concat!("`", stringify!($field), "`, as `", $ros, "` defines it.")] pub $field: $type,)+
        }

        impl Cdr for $name {
            const NAME: &'static str = $ros;

            fn write(&self, to: &mut CdrWriter) {
                $(self.$field.write(to);)+
            }

            fn read(from: &mut CdrReader<'_>) -> Option<Self> {
                Some(Self { $($field: Cdr::read(from)?,)+ })
            }

            fn define(to: &mut Vec<(&'static str, String)>) {
                if to.iter().any(|(name, _)| *name == Self::NAME) {
                    return;
                }
                $(<$type as Cdr>::define(to);)+
                let fields = [$(format!("{} {}\n", <$type as Cdr>::field_type(), stringify!($field).trim_start_matches("r#"))),+];
                to.push((Self::NAME, fields.concat()));
            }
        })+
    };
}

messages! {
    /// A time, s and ns.
    Time = "builtin_interfaces/Time" { sec: i32, nanosec: u32 }
    /// A span, s and ns.
    Duration = "builtin_interfaces/Duration" { sec: i32, nanosec: u32 }
    /// When, and in which frame of coordinates.
    Header = "std_msgs/Header" { stamp: Time, frame_id: String }
    /// A colour, 0..=1.
    Color = "std_msgs/ColorRGBA" { r: f32, g: f32, b: f32, a: f32 }
    /// A vector.
    Vector3 = "geometry_msgs/Vector3" { x: f64, y: f64, z: f64 }
    /// A point, m.
    Point = "geometry_msgs/Point" { x: f64, y: f64, z: f64 }
    /// A rotation.
    Quaternion = "geometry_msgs/Quaternion" { x: f64, y: f64, z: f64, w: f64 }
    /// A position and an orientation.
    Pose = "geometry_msgs/Pose" { position: Point, orientation: Quaternion }
    /// A translation and a rotation.
    Transform = "geometry_msgs/Transform" { translation: Vector3, rotation: Quaternion }
    /// Where a child's frame is in the header's.
    TransformStamped = "geometry_msgs/TransformStamped" { header: Header, child_frame_id: String, transform: Transform }
    /// Transforms between frames.
    TfMessage = "tf2_msgs/TFMessage" { transforms: Vec<TransformStamped> }
    /// A force (N) and a torque (N m).
    Wrench = "geometry_msgs/Wrench" { force: Vector3, torque: Vector3 }
    /// A wrench about the origin of the header's frame.
    WrenchStamped = "geometry_msgs/WrenchStamped" { header: Header, wrench: Wrench }
    /// A number that each point of a cloud has.
    PointField = "sensor_msgs/PointField" { name: String, offset: u32, datatype: u8, count: u32 }
    /// A cloud of points.
    PointCloud2 = "sensor_msgs/PointCloud2" {
        header: Header, height: u32, width: u32, fields: Vec<PointField>, is_bigendian: bool, point_step: u32, row_step: u32,
        data: Vec<u8>, is_dense: bool,
    }
    /// What a dimension of an array is.
    MultiArrayDimension = "std_msgs/MultiArrayDimension" { label: String, size: u32, stride: u32 }
    /// How an array is laid out.
    MultiArrayLayout = "std_msgs/MultiArrayLayout" { dim: Vec<MultiArrayDimension>, data_offset: u32 }
    /// Numbers.
    Float32MultiArray = "std_msgs/Float32MultiArray" { layout: MultiArrayLayout, data: Vec<f32> }
    /// Positions of joints, rad or m.
    JointState = "sensor_msgs/JointState" {
        header: Header, name: Vec<String>, position: Vec<f64>, velocity: Vec<f64>, effort: Vec<f64>,
    }
    /// An image as a file's bytes.
    CompressedImage = "sensor_msgs/CompressedImage" { header: Header, format: String, data: Vec<u8> }
    /// A place in a texture.
    UvCoordinate = "visualization_msgs/UVCoordinate" { u: f32, v: f32 }
    /// A mesh as a file's bytes.
    MeshFile = "visualization_msgs/MeshFile" { filename: String, data: Vec<u8> }
    /// Something to draw.
    Marker = "visualization_msgs/Marker" {
        header: Header, ns: String, id: i32, r#type: i32, action: i32, pose: Pose, scale: Vector3, color: Color,
        lifetime: Duration, frame_locked: bool, points: Vec<Point>, colors: Vec<Color>, texture_resource: String,
        texture: CompressedImage, uv_coordinates: Vec<UvCoordinate>, text: String, mesh_resource: String,
        mesh_file: MeshFile, mesh_use_embedded_materials: bool,
    }
    /// Things to draw, or to draw no more.
    MarkerArray = "visualization_msgs/MarkerArray" { markers: Vec<Marker> }
    /// A word and its value.
    KeyValue = "diagnostic_msgs/KeyValue" { key: String, value: String }
    /// How a part of the robot is doing.
    DiagnosticStatus = "diagnostic_msgs/DiagnosticStatus" {
        level: Byte, name: String, message: String, hardware_id: String, values: Vec<KeyValue>,
    }
    /// How parts of the robot are doing.
    DiagnosticArray = "diagnostic_msgs/DiagnosticArray" { header: Header, status: Vec<DiagnosticStatus> }
}

macro_rules! topics {
    ($($name:ident = $type:literal $hash:literal)+) => {
        $(impl Message for $name {
            const TYPE: &'static str = $type;
            const HASH: &'static str = concat!("RIHS01_", $hash);
        })+
    };
}

topics! {
    PointCloud2 = "sensor_msgs/msg/PointCloud2" "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"
    MarkerArray = "visualization_msgs/msg/MarkerArray" "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf"
    WrenchStamped = "geometry_msgs/msg/WrenchStamped" "8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77"
    DiagnosticArray = "diagnostic_msgs/msg/DiagnosticArray" "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"
    TfMessage = "tf2_msgs/msg/TFMessage" "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"
    Float32MultiArray = "std_msgs/msg/Float32MultiArray" "0599f6f85b4bfca379873a0b4375a0aca022156bd2d7021275d116ed1fa8bfe0"
    JointState = "sensor_msgs/msg/JointState" "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"
}

impl Time {
    /// The time after ROS's zero.
    #[must_use]
    pub fn frame_time(&self) -> FrameTime {
        FrameTime::from_ns(self.nanoseconds())
    }

    /// The time after ROS's zero, ns.
    #[must_use]
    pub fn nanoseconds(&self) -> i64 {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }

    /// The time `ns` after ROS's zero; the last one that it has where that is later.
    #[must_use]
    pub fn from_ns(ns: u64) -> Self {
        let sec = i32::try_from(ns / 1_000_000_000);
        sec.map_or(Self { sec: i32::MAX, nanosec: 999_999_999 }, |sec| Self {
            sec,
            nanosec: (ns % 1_000_000_000) as u32,
        })
    }
}
