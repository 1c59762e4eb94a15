//! Taxels as clouds of points, and links as transforms.

use std::collections::HashMap;
use std::f64::consts::FRAC_PI_2;

use glam::{DQuat, DVec3};

use crate::body::Body;
use crate::robot::messages::{
    Header, PointCloud2, PointField, Quaternion, TfMessage, Time, Transform, TransformStamped, Vector3,
};
use crate::signal::Pose;

/// The frame of coordinates that links are in: z up, as REP 103 has it.
pub(super) const WORLD: &str = "world";
/// `UINT32` and `FLOAT32` of `sensor_msgs/PointField`.
const UINT32: u8 = 6;
const FLOAT32: u8 = 7;
/// x, y, z and pressure, and the taxel's id.
const POINT_BYTES: u32 = 20;

/// Turns the body's world, whose y is up, to ROS's, whose z is up.
pub(super) fn z_up_from_y_up() -> DQuat {
    DQuat::from_rotation_x(FRAC_PI_2)
}

pub(super) fn vector(v: DVec3) -> Vector3 {
    Vector3 { x: v.x, y: v.y, z: v.z }
}

pub(super) fn quaternion(q: DQuat) -> Quaternion {
    Quaternion { x: q.x, y: q.y, z: q.z, w: q.w }
}

pub(super) fn header(time_ns: u64, frame_id: &str) -> Header {
    Header { stamp: Time::from_ns(time_ns), frame_id: frame_id.to_owned() }
}

/// `name` as a part of a topic's name: letters, digits, `_` and `/`, no part of which begins with a digit.
pub(super) fn topic_part(name: &str) -> String {
    let part = |part: &str| {
        let word: String = part.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        if word.is_empty() || word.starts_with(|c: char| c.is_ascii_digit()) { format!("_{word}") } else { word }
    };
    name.split('/').map(part).collect::<Vec<_>>().join("/")
}

/// The links that have taxels, a cloud each.
pub(super) struct Clouds {
    /// By link with taxels.
    links: Vec<String>,
    /// By taxel id, the cloud and the position in its link, m.
    taxels: HashMap<u32, (usize, DVec3)>,
    points: Vec<Vec<u8>>,
}

impl Clouds {
    pub(super) fn new(body: &Body) -> Self {
        let mut carriers: Vec<usize> = body.taxels.iter().map(|taxel| taxel.link).collect();
        carriers.sort_unstable();
        carriers.dedup();
        let cloud_of = |link: usize| carriers.binary_search(&link).unwrap_or_default();
        let taxels =
            body.taxels.iter().map(|taxel| (taxel.id, (cloud_of(taxel.link), taxel.position_in_link))).collect();
        let links: Vec<String> = carriers.iter().map(|&link| body.links[link].name.clone()).collect();
        Self { points: vec![Vec::new(); links.len()], links, taxels }
    }

    pub(super) fn links(&self) -> &[String] {
        &self.links
    }

    /// The cloud of each link: the taxels among `pressures`, in their link's frame.
    pub(super) fn messages(
        &mut self,
        time_ns: u64,
        pressures: &[(u32, f64)],
    ) -> impl Iterator<Item = PointCloud2> + '_ {
        self.points.iter_mut().for_each(Vec::clear);
        for (id, pressure) in pressures {
            if let Some((cloud, place)) = self.taxels.get(id) {
                let numbers = [place.x, place.y, place.z, *pressure];
                let points = &mut self.points[*cloud];
                points.extend(numbers.into_iter().flat_map(|number| (number as f32).to_le_bytes()));
                points.extend(id.to_le_bytes());
            }
        }
        self.links.iter().zip(&mut self.points).map(move |(link, points)| {
            let data = std::mem::take(points);
            let field = |(name, offset, datatype): (&str, u32, u8)| PointField {
                name: name.to_owned(),
                offset,
                datatype,
                count: 1,
            };
            let of_point = [("x", 0, FLOAT32), ("y", 4, FLOAT32), ("z", 8, FLOAT32), ("pressure", 12, FLOAT32)];
            PointCloud2 {
                header: header(time_ns, link),
                height: 1,
                width: data.len() as u32 / POINT_BYTES,
                fields: of_point.into_iter().chain([("taxel", 16, UINT32)]).map(field).collect(),
                is_bigendian: false,
                point_step: POINT_BYTES,
                row_step: data.len() as u32,
                data,
                is_dense: true,
            }
        })
    }
}

/// Where the links of `posed` are, or all of `at_rest` where it has none.
pub(super) fn transforms(time_ns: u64, at_rest: &[(String, Pose)], posed: &[(String, Pose)]) -> TfMessage {
    let poses = if posed.is_empty() { at_rest } else { posed };
    let turn = z_up_from_y_up();
    let transform = |(link, pose): &(String, Pose)| TransformStamped {
        header: header(time_ns, WORLD),
        child_frame_id: link.clone(),
        transform: Transform {
            translation: vector(turn * pose.translation),
            rotation: quaternion((turn * pose.rotation).normalize()),
        },
    };
    TfMessage { transforms: poses.iter().map(transform).collect() }
}

/// The links of `body` at rest, in the world.
pub(super) fn rest_poses(body: &Body) -> Vec<(String, Pose)> {
    let pose = |link: &crate::body::Link| {
        let (_, rotation, translation) = link.world_from_link.to_scale_rotation_translation();
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
    fn what_points_up_in_the_body_points_up_in_ros() {
        let up = z_up_from_y_up() * DVec3::Y;
        assert!(up.distance(DVec3::Z) < 1e-15 && (z_up_from_y_up() * DVec3::X).distance(DVec3::X) < 1e-15);
    }
}
