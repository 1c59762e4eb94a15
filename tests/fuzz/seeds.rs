//! Sound inputs, made here or taken from the examples.

use std::io::Write as _;

use glam::DVec3;
use serde_json::json;
use somatic::OutputPath;
use somatic::body::{FieldSpec, LinkJoint, MemberSpec, Modality, Taxel};
use somatic::internal::body::{Glb, LinkMimic, LinkMotion, MeshData};
use somatic::internal::robot::messages::{
    Float32MultiArray, Header, JointState, Message as _, PointCloud2, PointField, TfMessage, TransformStamped,
};
use somatic::recording::Recorder;
use somatic::{Frame, RawValue};

pub(super) const ROOT: &str = env!("CARGO_MANIFEST_DIR");

pub(super) fn file(path: &str) -> Vec<u8> {
    std::fs::read(format!("{ROOT}/{path}")).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// Lines of text in each of the ways that boards print them.
pub(super) fn text() -> Vec<String> {
    let rows = |line: &dyn Fn(usize) -> String| (0..24).map(|row| line(row) + "\n").collect::<String>();
    let mat = |end: &'static str| rows(&|row| format!("{row},0,0\n0,{},7\n{end}", row % 5));
    vec![
        rows(&|row| format!("{},300,{}", 512 - row % 7, row % 3)),
        format!("boot v1.2\ntime_ms;a;b\n{}", rows(&|row| format!("{};{},5;3", 20 * row, row % 7))),
        rows(&|row| format!("{}\t-2.5\tnan\t", row * 16)),
        rows(&|row| format!("A0: {}, A1: 7", row % 9)),
        rows(&|row| format!("s{}={}", row % 3, row)),
        rows(&|row| format!(r#"{{"t":{},"values":{{"4":{},"5":null}}}}"#, 0.02 * row as f64, row % 4)),
        rows(&|row| format!("[[1,2],[3,{row}]]")),
        rows(&|row| format!("2031-05-06T07:08:{row:02}Z,1,{}", row % 3)),
        mat(""),
        mat("--"),
    ]
}

pub(super) const URDF: &str = r#"<?xml version="1.0"?>
<robot name="r">
  <link name="base"><visual><origin xyz="0 0 0.1" rpy="0 0.1 0"/><geometry><box size="0.2 0.2 0.2"/></geometry></visual></link>
  <link name="arm"><visual><geometry><cylinder radius="0.03" length="0.3"/></geometry></visual>
    <collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <link name="hand"><visual><geometry><sphere radius="0.05"/></geometry></visual></link>
  <joint name="a" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0 0 0.3"/><axis xyz="0 1 0"/><limit lower="-1" upper="2"/></joint>
  <joint name="b" type="prismatic"><parent link="arm"/><child link="hand"/><origin xyz="0 0 0.2"/><axis xyz="0 0 1"/><mimic joint="a" multiplier="0.1" offset="0.01"/></joint>
  <sensor name="s" update_rate="100"><parent link="hand"/><origin xyz="0 0 0.05"/><tactile channel="skin">
    <array rows="2" cols="3" size="0.01 0.01" spacing="0.012 0.012" offset="0 0"/></tactile></sensor>
</robot>
"#;

pub(super) const DAE: &str = r##"<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="millimeter" meter="0.001"/><up_axis>Z_UP</up_axis></asset>
  <library_geometries><geometry id="g" name="g"><mesh>
    <source id="p"><float_array id="pa" count="12">0 0 0 100 0 0 0 100 0 0 0 100</float_array>
      <technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    <triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 1 2 3 0 3 2</p></triangles>
    <polylist count="1"><input semantic="VERTEX" source="#v" offset="0"/><vcount>3</vcount><p>0 1 2</p></polylist>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="s"><node id="n"><matrix>1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1</matrix>
    <node id="m"><translate>1 2 3</translate><instance_geometry url="#g"/></node></node></visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>
"##;

pub(super) const OBJ: &str = "# a tetrahedron\no t\nv 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nvn 0 0 1\nvt 0 0\ng one\n\
    f 1 3 2\nf 1/1 2/1 4/1\nf 2//1 3//1 4//1\nf 1/1/1 4/1/1 3/1/1\n";

pub(super) const STL: &str = "solid t\n facet normal 0 0 -1\n  outer loop\n   vertex 0 0 0\n   vertex 0 0.1 0\n   vertex 0.1 0 0\n  endloop\n \
    endfacet\n facet normal 0 -1 0\n  outer loop\n   vertex 0 0 0\n   vertex 0.1 0 0\n   vertex 0 0 0.1\n  endloop\n endfacet\nendsolid t\n";

pub(super) fn binary_stl() -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend(2_u32.to_le_bytes());
    for corners in
        [[[0.0_f32, 0.0, 0.0], [0.0, 0.1, 0.0], [0.1, 0.0, 0.0]], [[0.0; 3], [0.1, 0.0, 0.0], [0.0, 0.0, 0.1]]]
    {
        bytes.extend([0; 12]);
        corners.iter().flatten().for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

pub(super) const PLY: &str = "ply\nformat ascii 1.0\ncomment made here\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    property uchar red\nelement face 3\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1\n0.1 0 0 2\n0 0.1 0 3\n0 0 0.1 4\n\
    3 0 2 1\n3 0 1 3\n4 0 1 2 3\n";

pub(super) fn binary_ply() -> Vec<u8> {
    let mut bytes = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        .to_vec();
    [0.0_f32, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.1, 0.0].iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    bytes.push(3);
    [0_i32, 1, 2].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    bytes
}

pub(super) const ICUB: &str = "name left_forearm\nspatial_sampling taxel\ntaxel2Repr ( -1 1 1 -2 1 )\n[calibration]\n0 0 0 0 0 0\n0.01 0.02 0.03 0 0 1\n0.02 0.02 0.03 0 0 2\n\
    0.03 0.01 0 0.6 0.8 0\n0.03 0.01 0 0 0 0\n";

pub(super) const MJCF: &str = r#"<mujoco model="skin"><compiler angle="degree"/>
  <default><geom solimp="0 0.95 0.02"/><default class="skin"><geom type="mesh" mass="0" group="3"/></default></default>
  <asset><mesh name="plate" builtin="plate" params="5 7" scale="0.02 0.03 0.01"/>
    <mesh name="tetra" vertex="0 0 0 0.03 0 0 0 0.03 0 0 0 0.03" face="0 2 1 0 1 3 0 3 2 1 2 3"/></asset>
  <worldbody><body name="palm" pos="0 0 0.5" euler="30 20 10"><freejoint/><geom type="box" size="0.02 0.03 0.01" mass="0.1"/>
    <geom class="skin" name="palm skin" mesh="plate"/><site name="inside" pos="0 0 0.004" euler="180 0 0"/>
    <body name="nail" pos="0.05 0 0" axisangle="0 1 0 40" childclass="skin"><geom name="nail skin" mesh="tetra"/></body></body></worldbody>
  <sensor><tactile name="palm" geom="palm skin" mesh="plate"/><plugin name="grid" plugin="mujoco.sensor.touch_grid" objtype="site" objname="inside">
    <config key="nchannel" value="3"/><config key="size" value="7 7"/><config key="fov" value="45 45"/><config key="gamma" value="0"/></plugin>
    <tactile name="nail" geom="nail skin" mesh="tetra"/></sensor></mujoco>
"#;

/// A body with all that a body has.
pub(super) fn glb() -> Vec<u8> {
    let mut glb = Glb::new();
    let arm = glb.node("arm", None, DVec3::ZERO);
    let hand = glb.node("hand", Some(arm), DVec3::X);
    let mesh = MeshData {
        positions: vec![[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.1, 0.1, 0.0]],
        normals: vec![[0.0, 0.0, 1.0]; 4],
        triangles: vec![[0, 1, 2], [1, 3, 2]],
        skinning: None,
    };
    glb.mesh(arm, "skin", &mesh, None, None);
    let taxel = |id: u32| Taxel {
        id,
        link: 0,
        position_in_link: DVec3::new(0.01 * f64::from(id), 0.02, 0.0),
        normal_in_link: DVec3::Z,
        area: 1e-4,
        modality: Modality::Pressure,
        tangent_in_link: None,
    };
    glb.taxels("taxels", Some(arm), &[taxel(1), taxel(2), taxel(3)], None);
    let members = |ids: &[u32]| ids.iter().map(|&id| (id, MemberSpec::default())).collect();
    let field = FieldSpec {
        name: "arm/a".to_owned(),
        members: members(&[1, 2, 3]),
        parent: Some("arm".to_owned()),
        chart: None,
    };
    glb.field(&field, Some(arm), DVec3::ZERO);
    glb.field(&FieldSpec { name: "arm".to_owned(), ..FieldSpec::default() }, Some(arm), DVec3::ZERO);
    let mimic = Some(LinkMimic { joint: "other".to_owned(), multiplier: 2.0, offset: 0.1 });
    let motion = LinkMotion::Revolute(DVec3::Z);
    glb.joint(hand, &LinkJoint { name: "wrist".to_owned(), motion, limits: Some([-1.0, 1.0]), mimic });
    glb.to_bytes().unwrap()
}

/// A glTF with its buffer inside.
pub(super) fn gltf() -> Vec<u8> {
    let original = somatic::internal::body::Original::from_bytes("a", &glb(), None).unwrap();
    original.to_gltf().into_bytes()
}

/// A recording of 200 frames of three taxels, with an attachment.
pub(super) fn mcap() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let mut recorder = Recorder::create(OutputPath::new(&path, false, &[]).unwrap(), &[1, 2, 9]).unwrap();
    recorder.attach("calibration.toml", "application/toml", b"[all]\nbaseline = 2\n").unwrap();
    for frame in 0..200 {
        let mut of = Frame::missing(f64::from(frame) * 0.01, 3);
        of.values[0] = RawValue::new(f64::from(frame));
        of.values[2] = RawValue::new(0.5 * f64::from(frame));
        recorder.frame(&of).unwrap();
    }
    recorder.finish().unwrap();
    std::fs::read(&path).unwrap()
}

fn header() -> Header {
    Header { frame_id: "hand".to_owned(), ..Header::default() }
}

pub(super) fn point_cloud() -> Vec<u8> {
    let field = |name: &str, offset, datatype| PointField { name: name.to_owned(), offset, datatype, count: 1 };
    let data: Vec<u8> = (0..4_u32).flat_map(|id| [id.to_le_bytes(), (id as f32).to_le_bytes()].concat()).collect();
    let cloud = PointCloud2 {
        header: header(),
        height: 1,
        width: 4,
        fields: vec![field("taxel", 0, 6), field("value", 4, 7)],
        is_bigendian: false,
        point_step: 8,
        row_step: 32,
        data,
        is_dense: true,
    };
    cloud.to_cdr()
}

pub(super) fn joint_state() -> Vec<u8> {
    let names = ["a", "b", "c"].map(str::to_owned).to_vec();
    JointState { header: header(), name: names, position: vec![0.1, 0.2, 0.3], ..JointState::default() }.to_cdr()
}

pub(super) fn transforms() -> Vec<u8> {
    let one = TransformStamped { header: header(), child_frame_id: "finger".to_owned(), ..TransformStamped::default() };
    TfMessage { transforms: vec![one.clone(), one] }.to_cdr()
}

pub(super) fn number_array() -> Vec<u8> {
    Float32MultiArray { data: vec![1.0, 2.5, -3.0], ..Float32MultiArray::default() }.to_cdr()
}

/// A folder's metadata and its one file, as a bag of joint states and frames.
pub(super) fn bag() -> (Vec<u8>, Vec<u8>) {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("bag");
    let csv = folder.path().join("a.csv");
    let mut text = std::fs::File::create(&csv).unwrap();
    writeln!(text, "t,0,1,2").unwrap();
    (0..30).for_each(|i| writeln!(text, "{},{i},{},3", 0.1 * f64::from(i), 2 * i).unwrap());
    let sink = format!("ros2-mcap:{}", bag.display());
    super::program::succeeds(&[
        "run",
        "--body",
        "hand",
        "--source",
        csv.to_str().unwrap(),
        "--sink",
        &sink,
        "--backend",
        "cpu",
    ]);
    let metadata = std::fs::read(bag.join("metadata.yaml")).unwrap();
    let files = std::fs::read_dir(&bag).unwrap().map(|entry| entry.unwrap().path());
    let mcap = files.into_iter().find(|path| path.extension().is_some_and(|ending| ending == "mcap")).unwrap();
    (metadata, std::fs::read(mcap).unwrap())
}

/// The messages of [`bag`] as rosbag2 of Humble writes them in SQLite.
pub(super) fn bag_db3() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.db3");
    let database = rusqlite::Connection::open(&path).unwrap();
    let tables = "BEGIN;
        CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
        CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
        CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
            serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
        CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
        CREATE INDEX timestamp_idx ON messages (timestamp ASC);
        INSERT INTO schema VALUES (3, 'humble');";
    database.execute_batch(tables).unwrap();
    let mut topics: Vec<String> = Vec::new();
    for message in mcap::MessageStream::new(&bag().1).unwrap() {
        let message = message.unwrap();
        let (topic, kind) = (&message.channel.topic, &message.channel.schema.as_ref().unwrap().name);
        let at = topics.iter().position(|known| known == topic).unwrap_or_else(|| {
            topics.push(topic.clone());
            let add = "INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr', '')";
            database.execute(add, (topics.len() as i64, topic, kind)).unwrap();
            topics.len() - 1
        });
        let add = "INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)";
        database.execute(add, (at as i64 + 1, message.log_time as i64, message.data.as_ref())).unwrap();
    }
    database.execute_batch("COMMIT").unwrap();
    drop(database);
    std::fs::read(path).unwrap()
}

pub(super) const MAP: &str = "message = '/hand'\ntype = 'maker/msg/Hand'\nvalues = ['pads[*].pressure', 'data[2:5]', 'one']\nids = '4-19'\n\
    grid = '4x4'\npitch = '4mm,5mm'\nmissing = [30000, -1]\nscale = 1e-4\ntime = 'clock:ms'\ndecoder = 'i16le'\n\
    [[pads]]\nname = 'tip'\ngrid = '4x4'\npitch = '2mm'\nat_mm = [-3, 4.5]\n";

pub(super) const MAP_OF_SENSORS: &str = "values = 'sensors[*].values'\nnames = 'sensors[*].name'\nmissing = [0]\ndefinition = 'Hand.msg'\n\
    registers = { tip = [3000, 9], palm = [4900, 112] }\n";

pub(super) const NAMED_LINES: &str = "{\"t\":0,\"pads\":[{\"n\":\"tip\",\"p\":[1,2]},{\"n\":\"palm\",\"p\":[3]}],\"digits\":\"00\"}\n\
    {\"t\":0.1,\"pads\":[{\"n\":\"tip\",\"p\":[1,2]},{\"n\":\"palm\",\"p\":[4]}],\"digits\":\"01\"}\n";

pub(super) const MAPPED_LINES: &str = "{\"t\":0,\"pads\":[{\"p\":[1,2]},{\"p\":[3,4]}],\"digits\":\"00ff\"}\n\
    {\"t\":0.1,\"pads\":[{\"p\":[9,0]},{\"p\":[3,4]}],\"digits\":\"0a0b\"}\n";

pub(super) const NDJSON: &str = "{\"t\":0,\"values\":{\"1\":3,\"2\":4.5}}\n{\"t\":0.1,\"values\":{\"1\":null,\"9\":1e3},\"joints\":{\"a\":0.5}}\n\
    {\"t\":0.2,\"values\":{},\"pose\":{\"hand\":[0,0,1,0,0,0,1]}}\n{\"t\":0.3,\"values\":{\"1\":1}}\n";

pub(super) const CSV: &str = "t,1,2,9\n0,1,2,3\n0.1,4,,6\n0.2,nan,8,9\n0.3,inf,1e3,-5\n0.4,1,2,3\n";

pub(super) const CSV_SKIN: &str = "id,link,x,y,z,nx,ny,nz,area,modality\n1,hand,0,0,0,0,0,1,0.0001,pressure\n2,hand,0.01,0,0,0,0,1,,\n3,arm,0,0.2,0,0,1,0,0.0002,temperature\n";

pub(super) const CALIBRATION: &str = "[all]\nbaseline = 2\ndead_band = 1.5\np_max = 30\nunit = \"kPa\"\nnoise = 0.2\n\
    [taxel.2]\ngain = 3\n[contact]\non = 3\noff = 1\n[checks]\nisolated_ratio = 5\n";

pub(super) fn line_of_a_board() -> Vec<u8> {
    use somatic::internal::wire::{Bits, Head, Identity, MAX_ENCODED_BYTES, encode};
    let mut line = Vec::new();
    let mut to = [0; MAX_ENCODED_BYTES];
    let head = |sequence: u32| Head { board: 3, boot: 1, sequence, time_us: 1000 * sequence };
    let identity = Identity {
        request: 1,
        running: true,
        channels: 4,
        bits: Bits::Twelve,
        layout: 7,
        rate_mhz: 100_000,
        firmware: "made here",
    };
    let length = encode::identity(&mut to, &head(0), &identity).unwrap();
    line.extend(&to[..length]);
    for sequence in 1..8 {
        let length = encode::frame(&mut to, &head(sequence), Bits::Twelve, &[1, 2, 3, sequence as u16]).unwrap();
        line.extend(&to[..length]);
    }
    line
}

pub(super) const HTTP: &str =
    "GET / HTTP/1.1\r\nHost: ADDRESS\r\nUser-Agent: fuzz\r\nAccept: */*\r\nConnection: close\r\n\r\n";

/// A handshake, the token and some requests; masked by zeros.
pub(super) fn web_socket() -> Vec<u8> {
    let mut bytes = b"GET /socket HTTP/1.1\r\nHost: ADDRESS\r\nOrigin: http://ADDRESS\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
        Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
        .to_vec();
    let mut frame = |opcode: u8, payload: &[u8]| {
        bytes.extend([0x80 | opcode, 0x80 | payload.len() as u8, 0, 0, 0, 0]);
        bytes.extend(payload);
    };
    frame(
        1,
        json!({"type": "hello", "version": 4, "token": "0123456789abcdef0123456789abcdef", "after_event": null})
            .to_string()
            .as_bytes(),
    );
    frame(1, br#"{"type":"drawn","frame":1}"#);
    frame(9, b"ping");
    frame(8, &[0x03, 0xE8]);
    bytes
}
