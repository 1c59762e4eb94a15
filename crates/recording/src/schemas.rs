//! The schemas of the messages, written into the file itself, so that any viewer can read them: Protocol Buffers' own
//! descriptors, made from the tables below. Those of package `foxglove` are the well-known ones that viewers draw.

use super::proto::Writer;

/// A message and its fields, `[repeated] TYPE NAME NUMBER`, TYPE a scalar or another message of the package or, with a
/// dot, of another. `enum TYPE` is an enumeration that stands in a message.
type Message = (&'static str, &'static str);

/// An enumeration within a message: that message, its own name, and its names from 0.
type Enumeration = (&'static str, &'static str, &'static str);

const GOOGLE: [(&str, Message); 2] = [
    ("google/protobuf/timestamp.proto", ("Timestamp", "int64 seconds 1; int32 nanos 2")),
    ("google/protobuf/duration.proto", ("Duration", "int64 seconds 1; int32 nanos 2")),
];

const FOXGLOVE: [Message; 21] = [
    ("Vector3", "double x 1; double y 2; double z 3"),
    ("Point3", "double x 1; double y 2; double z 3"),
    ("Quaternion", "double x 1; double y 2; double z 3; double w 4"),
    ("Pose", "Vector3 position 1; Quaternion orientation 2"),
    ("Color", "double r 1; double g 2; double b 3; double a 4"),
    ("KeyValuePair", "string key 1; string value 2"),
    ("PackedElementField", "string name 1; fixed32 offset 2; enum PackedElementField.NumericType type 3"),
    (
        "PointCloud",
        "google.protobuf.Timestamp timestamp 1; string frame_id 2; Pose pose 3; fixed32 point_stride 4; \
         repeated PackedElementField fields 5; bytes data 6",
    ),
    (
        "FrameTransform",
        "google.protobuf.Timestamp timestamp 1; string parent_frame_id 2; string child_frame_id 3; \
         Vector3 translation 4; Quaternion rotation 5",
    ),
    ("FrameTransforms", "repeated FrameTransform transforms 1"),
    (
        "ArrowPrimitive",
        "Pose pose 1; double shaft_length 2; double shaft_diameter 3; double head_length 4; double head_diameter 5; \
         Color color 6",
    ),
    ("CubePrimitive", "Pose pose 1; Vector3 size 2; Color color 3"),
    ("SpherePrimitive", "Pose pose 1; Vector3 size 2; Color color 3"),
    ("CylinderPrimitive", "Pose pose 1; Vector3 size 2; double bottom_scale 3; double top_scale 4; Color color 5"),
    (
        "LinePrimitive",
        "enum LinePrimitive.Type type 1; Pose pose 2; double thickness 3; bool scale_invariant 4; \
         repeated Point3 points 5; Color color 6; repeated Color colors 7; repeated fixed32 indices 8",
    ),
    (
        "TriangleListPrimitive",
        "Pose pose 1; repeated Point3 points 2; Color color 3; repeated Color colors 4; repeated fixed32 indices 5",
    ),
    (
        "TextPrimitive",
        "Pose pose 1; bool billboard 2; double font_size 3; bool scale_invariant 4; Color color 5; string text 6",
    ),
    (
        "ModelPrimitive",
        "Pose pose 1; Vector3 scale 2; Color color 3; bool override_color 4; string url 5; string media_type 6; \
         bytes data 7",
    ),
    ("SceneEntityDeletion", "google.protobuf.Timestamp timestamp 1; enum SceneEntityDeletion.Type type 2; string id 3"),
    (
        "SceneEntity",
        "google.protobuf.Timestamp timestamp 1; string frame_id 2; string id 3; google.protobuf.Duration lifetime 4; \
         bool frame_locked 5; repeated KeyValuePair metadata 6; repeated ArrowPrimitive arrows 7; \
         repeated CubePrimitive cubes 8; repeated SpherePrimitive spheres 9; repeated CylinderPrimitive cylinders 10; \
         repeated LinePrimitive lines 11; repeated TriangleListPrimitive triangles 12; repeated TextPrimitive texts 13; \
         repeated ModelPrimitive models 14",
    ),
    ("SceneUpdate", "repeated SceneEntityDeletion deletions 1; repeated SceneEntity entities 2"),
];

const ENUMERATIONS: [Enumeration; 3] = [
    ("PackedElementField", "NumericType", "UNKNOWN UINT8 INT8 UINT16 INT16 UINT32 INT32 FLOAT32 FLOAT64"),
    ("LinePrimitive", "Type", "LINE_STRIP LINE_LOOP LINE_LIST"),
    ("SceneEntityDeletion", "Type", "MATCHING_ID ALL"),
];

/// The messages of [`super::frames`].
const SOMATIC: [Message; 4] = [
    (
        "Frame",
        "double t 1; repeated float values 2; repeated uint32 missing 3; repeated uint32 present 4; repeated LinkPose poses 5; \
         repeated uint32 stale 6; repeated JointPosition joints 7; bool has_stale_pose 8; int64 t_rest 9",
    ),
    ("LinkPose", "string link 1; repeated double pose 2"),
    ("JointPosition", "string joint 1; double position 2"),
    ("Field", "google.protobuf.Timestamp timestamp 1; double total 2; double area 3"),
];

pub(super) fn somatic() -> Vec<u8> {
    let mut set = Vec::new();
    let mut writer = Writer(&mut set);
    let (path, message) = GOOGLE[0];
    file(&mut writer, path, "google.protobuf", &[], &[message], &[]);
    file(&mut writer, "somatic.proto", "somatic", &[path], &SOMATIC, &[]);
    set
}

pub(super) fn foxglove() -> Vec<u8> {
    let mut set = Vec::new();
    let mut writer = Writer(&mut set);
    for (path, message) in GOOGLE {
        file(&mut writer, path, "google.protobuf", &[], &[message], &[]);
    }
    file(&mut writer, "foxglove.proto", "foxglove", &GOOGLE.map(|(path, _)| path), &FOXGLOVE, &ENUMERATIONS);
    set
}

// Numbers of fields in `descriptor.proto`.
fn file(
    set: &mut Writer<'_>,
    path: &str,
    package: &str,
    needs: &[&str],
    messages: &[Message],
    enumerations: &[Enumeration],
) {
    set.message(1, |file| {
        file.text(1, path);
        file.text(2, package);
        for path in needs {
            file.text(3, path);
        }
        for (name, fields) in messages {
            file.message(4, |message| {
                message.text(1, name);
                for words in fields.split(';') {
                    message.message(2, |descriptor| field(descriptor, package, words));
                }
                for (_, name, values) in enumerations.iter().filter(|(within, ..)| within == name) {
                    message.message(4, |enumeration| {
                        enumeration.text(1, name);
                        for (number, name) in (0..).zip(values.split(' ')) {
                            enumeration.message(2, |value| {
                                value.text(1, name);
                                value.number(2, number);
                            });
                        }
                    });
                }
            });
        }
        file.text(12, "proto3");
    });
}

fn field(descriptor: &mut Writer<'_>, package: &str, words: &str) {
    let mut words: Vec<&str> = words.split_whitespace().collect();
    let repeated = words[0] == "repeated";
    let is_enum = words[0] == "enum";
    if repeated || is_enum {
        words.remove(0);
    }
    let [kind, name, number] = words[..] else { unreachable!("the tables have three words a field") };
    descriptor.text(1, name);
    descriptor.number(3, number.parse().expect("the tables number their fields"));
    descriptor.number(4, if repeated { 3 } else { 1 });
    let scalars = ["double", "float", "int64", "", "int32", "", "fixed32", "bool", "string", "", "", "bytes", "uint32"];
    match scalars.iter().position(|scalar| *scalar == kind) {
        Some(index) => descriptor.number(5, index as u64 + 1),
        None => {
            descriptor.number(5, if is_enum { 14 } else { 11 });
            let named = if kind.starts_with("google.") { format!(".{kind}") } else { format!(".{package}.{kind}") };
            descriptor.text(6, &named);
        }
    }
}
