//! Taxels as clouds of points, and links as transforms.

use glam::{DQuat, DVec3};

use super::readings::Readings;
use crate::body::{Body, Link};
use crate::robot::messages::{
    Header, PointCloud2, PointField, Quaternion, TfMessage, Time, Transform, TransformStamped, Vector3,
};
use crate::scene::{SensedTaxels, SensedValue};
use crate::signal::{Pose, Reading, Receptor};

/// The frame of coordinates that links are in.
pub(super) const WORLD: &str = "world";
/// `UINT32` and `FLOAT32` of `sensor_msgs/PointField`.
const UINT32: u8 = 6;
const FLOAT32: u8 = 7;
/// A point: x, y, z, the pressure and the taxel's id, where the last two begin; then what its link's taxels read beside.
const POINT_BYTES: usize = 20;
const PRESSURE_AT: usize = 12;
const TAXEL_AT: usize = 16;

pub(super) fn vector(v: DVec3) -> Vector3 {
    Vector3 { x: v.x, y: v.y, z: v.z }
}

pub(super) fn quaternion(q: DQuat) -> Quaternion {
    Quaternion { x: q.x, y: q.y, z: q.z, w: q.w }
}

pub(super) fn header(time_ns: u64, frame_id: &str) -> Header {
    Header { stamp: Time::from_ns(time_ns), frame_id: frame_id.to_owned() }
}

/// `name` as a part of a topic's name: letters, digits, `_` and `/`. No part between slashes begins with a digit.
pub(super) fn topic_part(name: &str) -> String {
    let part = |part: &str| {
        let word: String = part.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        if word.is_empty() || word.starts_with(|c: char| c.is_ascii_digit()) { format!("_{word}") } else { word }
    };
    name.split('/').map(part).collect::<Vec<_>>().join("/")
}

/// The links that have taxels, a cloud each.
pub(super) struct Clouds(Vec<Cloud>);

/// The taxels of a link.
struct Cloud {
    link: String,
    /// Indices of the body, and points whose pressures are still to come.
    taxels: Vec<(usize, [u8; POINT_BYTES])>,
    /// Letters that its taxels have beside pressure.
    beside: Vec<Receptor>,
}

/// The fields of points that are of `receptor`.
fn fields_of(receptor: Receptor) -> &'static [&'static str] {
    match receptor {
        Receptor::Sustained | Receptor::Change => &[],
        Receptor::Shear => &["pressure_u", "pressure_v"],
        Receptor::Temperature => &["temperature"],
        Receptor::Proximity => &["distance_mm"],
    }
}

/// What `value` says in those fields; nothing where it has no reading.
fn numbers_of(value: &SensedValue) -> Option<[f64; 2]> {
    match (value.receptor, value.reading) {
        (Receptor::Shear, Reading::Value(..)) => Some(value.shear),
        (Receptor::Temperature, Reading::Value(celsius, _)) => Some([celsius; 2]),
        // Nearer ones are read as this one.
        (Receptor::Proximity, Reading::Value(distance_m, _)) if distance_m <= SensedValue::LEAST_DISTANCE_M => {
            Some([0.0; 2])
        }
        // Also where it is out of range: it is not missing, and a calibration says what is in range.
        (Receptor::Proximity, Reading::Value(distance_m, _)) => Some([distance_m * 1e3; 2]),
        _ => None,
    }
}

impl Clouds {
    /// Of the taxels of `body`, of which `sensed` read something else than pressure.
    pub(super) fn new(body: &Body, sensed: &SensedTaxels) -> Self {
        let empty = |link: &Link| Cloud { link: link.name.clone(), taxels: Vec::new(), beside: Vec::new() };
        let mut clouds: Vec<Cloud> = body.links.iter().map(empty).collect();
        for (taxel, receptor, _) in sensed.all() {
            let beside = &mut clouds[body.taxels[taxel].link].beside;
            if !beside.contains(&receptor) {
                beside.push(receptor);
            }
        }
        for (index, taxel) in body.taxels.iter().enumerate() {
            let mut point = [0; POINT_BYTES];
            let place = taxel.position_in_link.as_vec3().to_array();
            for (bytes, number) in point.chunks_exact_mut(4).zip(place) {
                bytes.copy_from_slice(&number.to_le_bytes());
            }
            point[TAXEL_AT..].copy_from_slice(&taxel.id.to_le_bytes());
            clouds[taxel.link].taxels.push((index, point));
        }
        clouds.retain(|cloud| !cloud.taxels.is_empty());
        Self(clouds)
    }

    pub(super) fn links(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(|cloud| cloud.link.as_str())
    }

    /// The cloud of each link: the taxels that have a reading, in their link's frame. A field that is not of a taxel is NaN.
    pub(super) fn messages(&self, time_ns: u64, readings: &Readings) -> impl Iterator<Item = PointCloud2> {
        self.0.iter().map(move |cloud| cloud.message(time_ns, readings))
    }
}

impl Cloud {
    fn message(&self, time_ns: u64, readings: &Readings) -> PointCloud2 {
        let point_step = POINT_BYTES + self.beside.iter().map(|&receptor| 4 * fields_of(receptor).len()).sum::<usize>();
        let mut data = Vec::with_capacity(self.taxels.len() * point_step);
        let mut is_dense = true;
        for (taxel, point) in &self.taxels {
            let pressure = readings.pressure(*taxel);
            let own = readings.sensed(*taxel).and_then(|value| Some((value.receptor, numbers_of(value)?)));
            // What is along the surface goes with what is along the normal.
            if pressure.is_none() && own.is_none_or(|(receptor, _)| receptor == Receptor::Shear) {
                continue;
            }
            let at = data.len() + PRESSURE_AT;
            data.extend_from_slice(point);
            let mut number = |number: Option<f64>| {
                is_dense &= number.is_some();
                number.map_or(f32::NAN, |number| number as f32).to_le_bytes()
            };
            data[at..][..4].copy_from_slice(&number(pressure));
            for &receptor in &self.beside {
                let numbers = own.filter(|&(own, _)| own == receptor).map(|(_, numbers)| numbers);
                for index in 0..fields_of(receptor).len() {
                    data.extend_from_slice(&number(numbers.map(|numbers| numbers[index])));
                }
            }
        }
        let field = |(name, offset, datatype): (&str, usize, u8)| PointField {
            name: name.to_owned(),
            offset: offset as u32,
            datatype,
            count: 1,
        };
        let of_point = [
            ("x", 0, FLOAT32),
            ("y", 4, FLOAT32),
            ("z", 8, FLOAT32),
            ("pressure", PRESSURE_AT, FLOAT32),
            ("taxel", TAXEL_AT, UINT32),
        ];
        let names = self.beside.iter().flat_map(|&receptor| fields_of(receptor));
        let more = names.enumerate().map(|(index, name)| (*name, POINT_BYTES + 4 * index, FLOAT32));
        PointCloud2 {
            header: header(time_ns, &self.link),
            height: 1,
            width: (data.len() / point_step) as u32,
            fields: of_point.into_iter().chain(more).map(field).collect(),
            is_bigendian: false,
            point_step: point_step as u32,
            row_step: data.len() as u32,
            data,
            is_dense,
        }
    }
}

/// Where the links of `posed` are, or all of `at_rest` where it has none.
pub(super) fn transforms(time_ns: u64, at_rest: &[(String, Pose)], posed: &[(String, Pose)]) -> TfMessage {
    let poses = if posed.is_empty() { at_rest } else { posed };
    let transform = |(link, pose): &(String, Pose)| TransformStamped {
        header: header(time_ns, WORLD),
        child_frame_id: link.clone(),
        transform: Transform { translation: vector(pose.translation), rotation: quaternion(pose.rotation.normalize()) },
    };
    TfMessage { transforms: poses.iter().map(transform).collect() }
}

/// The links of `body` at rest, in the world.
pub(super) fn rest_poses(body: &Body) -> Vec<(String, Pose)> {
    let pose = |link: &Link| {
        let (_, rotation, translation) = link.world_from_link().to_scale_rotation_translation();
        (link.name.clone(), Pose { translation, rotation })
    };
    body.links.iter().map(pose).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_names_of_topics() {
        assert_eq!(topic_part("hand/palm"), "hand/palm");
        assert_eq!(topic_part("left hand.2/7th"), "left_hand_2/_7th");
        assert_eq!(topic_part("é//a"), "_/_/a");
    }

    #[test]
    fn a_body_stands_upright_in_ros_and_looks_along_x() {
        let body = Body::from_bytes("humanoid", crate::bundled::HUMANOID).unwrap();
        let at_rest = rest_poses(&body);
        let place = |name: &str| at_rest.iter().find(|(link, _)| link == name).unwrap().1.translation;
        let TfMessage { transforms } = transforms(0, &at_rest, &[]);
        let root = &transforms[0].transform.rotation;
        assert_eq!([root.x, root.y, root.z, root.w], [0.5; 4]);
        assert!(place("head").z > 0.5 && place("left_hand").y > 0.05 && place("right_hand").y < -0.05);
    }
}
