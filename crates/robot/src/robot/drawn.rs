//! Poses of a body by joints drawn at random.

use glam::DAffine3;

use super::kinematics::Kinematics;
use super::matching::LinkMatches;
use crate::author::{DrawnPoses, drawn_position};
use crate::body::{Body, Up};
use crate::error::Result;

/// Poses of `body` with the joints of `robot`, whose axis `up` points up, as [`DrawnPoses::of_own_joints`] draws them. A link
/// that the robot does not have keeps its place on the link above it.
///
/// # Errors
/// As [`LinkMatches::new`].
pub fn drawn_poses(robot: &Kinematics, body: &Body, up: Up) -> Result<DrawnPoses> {
    let matches = LinkMatches::new(robot, body, up)?;
    let mut in_robot: Vec<Option<usize>> = vec![None; body.links.len()];
    for (index, name) in &matches.matched {
        if let Some(link) = body.link_index(name) {
            in_robot[link] = Some(*index);
        }
    }
    let body_from_root = up.body_from_root();
    Ok(DrawnPoses::draw(body, |random| {
        let joints = robot.joint_names().len();
        let position = |joint| drawn_position(robot.limits(joint), robot.unit(joint) == "rad", random);
        let positions: Vec<f64> = (0..joints).map(position).collect();
        let moved = robot.link_poses(&positions);
        let mut poses: Vec<DAffine3> = Vec::with_capacity(body.links.len());
        for (link, index) in body.links.iter().zip(&in_robot) {
            poses.push(match (index, link.parent) {
                (Some(index), _) => body_from_root * moved[*index].1,
                (None, Some(parent)) => {
                    poses[parent] * body.links[parent].body_from_link.inverse() * link.body_from_link
                }
                (None, None) => link.body_from_link,
            });
        }
        poses
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Glb;

    #[test]
    fn links_of_the_robot_move_and_others_move_with_them() {
        let urdf = r#"<robot name="r"><link name="arm"/><link name="hand"/><joint name="slide" type="prismatic">
            <parent link="arm"/><child link="hand"/><origin xyz="0 0 1"/><axis xyz="0 0 1"/><limit lower="1" upper="2"/></joint></robot>"#;
        let robot = Kinematics::from_urdf("r", urdf).unwrap();
        let mut glb = Glb::new();
        let arm = glb.placed_node("arm", None, Up::Z.body_from_root());
        let hand = glb.node("hand", Some(arm), glam::DVec3::Z);
        glb.node("finger", Some(hand), glam::DVec3::X);
        let body = Body::from_bytes("b", &glb.to_bytes().unwrap()).unwrap();
        let poses = drawn_poses(&robot, &body, Up::Z).unwrap();
        let mut seen = poses.of_link(2);
        assert!(seen.next().unwrap().translation.abs_diff_eq(glam::DVec3::new(0.0, 1.0, 1.0), 1e-6));
        let mut count = 0;
        for pose in seen {
            let at = pose.translation;
            assert!((2.0..3.0).contains(&at.y) && (at.z - 1.0).abs() < 1e-6 && at.x.abs() < 1e-6, "{at}");
            count += 1;
        }
        assert_eq!(count, 4);
        assert!(drawn_poses(&robot, &body, Up::Y).is_err());
    }
}
