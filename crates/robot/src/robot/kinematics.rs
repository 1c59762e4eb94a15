//! Forward kinematics of a URDF: where its links are, from the positions of its joints.

use std::collections::BTreeMap;
use std::path::Path;

use glam::{DAffine3, DQuat, DVec3};

use crate::author::mesh::{Driver, JointMotion, Robot, RobotJoint as UrdfJoint, followed, order};
use crate::error::Result;

/// A robot's links and joints, a parent before its children.
#[derive(Clone, Debug)]
pub struct Kinematics {
    links: Vec<RobotLink>,
    /// The joints that move on their own, in the order of the file.
    joints: Vec<RobotJoint>,
    /// The names of the others: fixed ones, and those that mimic.
    other_joints: Vec<String>,
}

#[derive(Clone, Debug)]
struct RobotLink {
    name: String,
    parent: Option<usize>,
    /// At rest.
    parent_from_link: DAffine3,
    drive: Drive,
}

/// What moves a link against its parent.
#[derive(Clone, Debug)]
enum Drive {
    Nothing,
    /// Its position is `multiplier` · that of the joint + `offset`.
    Joint {
        joint: usize,
        multiplier: f64,
        offset: f64,
        motion: JointMotion,
    },
    /// Only a pose of its own says where it is.
    Free,
}

#[derive(Clone, Debug)]
struct RobotJoint {
    name: String,
    is_continuous: bool,
    is_prismatic: bool,
    /// Of its positions, rad or m, where the file has a range.
    limits: Option<[f64; 2]>,
}

impl Kinematics {
    /// Reads the URDF at `path`. Its meshes are not opened.
    ///
    /// # Errors
    /// It is not a URDF, or its joints are not a tree; with the line.
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        Self::from_robot(&Robot::load_joints(path)?).map_err(|e| e.at(path.display()))
    }

    /// Reads a URDF from `text`; errors call it `name`.
    ///
    /// # Errors
    /// As [`Kinematics::load`].
    pub fn from_urdf(name: &str, text: &str) -> Result<Self> {
        Robot::joints_of(text).and_then(|robot| Self::from_robot(&robot)).map_err(|e| e.at(name))
    }

    fn from_robot(robot: &Robot) -> Result<Self> {
        let drivers = followed(robot)?;
        let is_own = |index: usize, joint: &UrdfJoint| joint.is_driven() && drivers[index].joint == index;
        let own: Vec<&UrdfJoint> = robot
            .joints
            .iter()
            .enumerate()
            .filter(|(index, joint)| is_own(*index, joint))
            .map(|(_, joint)| joint)
            .collect();
        let index_of: BTreeMap<&str, usize> =
            own.iter().enumerate().map(|(index, joint)| (&joint.name[..], index)).collect();
        let driver_of: BTreeMap<&str, Driver> =
            robot.joints.iter().zip(&drivers).map(|(joint, driver)| (&joint.name[..], *driver)).collect();
        let mut place_of = BTreeMap::new();
        let mut links = Vec::new();
        for (link, joint) in order(robot)? {
            place_of.insert(link.name.as_str(), links.len());
            let (parent, parent_from_link, drive) = match joint {
                None => (None, DAffine3::IDENTITY, Drive::Nothing),
                Some(joint) => {
                    let drive = match joint.motion {
                        JointMotion::Fixed => Drive::Nothing,
                        JointMotion::Free => Drive::Free,
                        motion => {
                            let Driver { joint: other, multiplier, offset } = driver_of[joint.name.as_str()];
                            let joint = index_of[robot.joints[other].name.as_str()];
                            Drive::Joint { joint, multiplier, offset, motion }
                        }
                    };
                    (Some(place_of[joint.parent.as_str()]), joint.parent_from_child, drive)
                }
            };
            links.push(RobotLink { name: link.name.clone(), parent, parent_from_link, drive });
        }
        let is_continuous = |motion: &JointMotion| matches!(motion, JointMotion::Revolute { is_continuous: true, .. });
        let joint = |joint: &&UrdfJoint| RobotJoint {
            name: joint.name.clone(),
            is_continuous: is_continuous(&joint.motion),
            is_prismatic: matches!(joint.motion, JointMotion::Prismatic { .. }),
            limits: joint.limits.filter(|_| !is_continuous(&joint.motion)),
        };
        let is_other = |joint: &&UrdfJoint| !index_of.contains_key(joint.name.as_str());
        let other_joints = robot.joints.iter().filter(is_other).map(|joint| joint.name.clone()).collect();
        Ok(Self { links, joints: own.iter().map(joint).collect(), other_joints })
    }

    /// The names of the joints that move on their own (revolute, continuous and prismatic ones that mimic none), in the
    /// order of the file: the order of positions.
    pub fn joint_names(&self) -> impl ExactSizeIterator<Item = &str> {
        self.joints.iter().map(|joint| joint.name.as_str())
    }

    /// The names of the links, a parent before its children: the order of poses.
    pub fn link_names(&self) -> impl ExactSizeIterator<Item = &str> {
        self.links.iter().map(|link| link.name.as_str())
    }

    /// Whether joint `joint` turns, and not without end.
    #[must_use]
    pub fn is_limited_turn(&self, joint: usize) -> bool {
        let RobotJoint { is_continuous, is_prismatic, .. } = self.joints[joint];
        !is_continuous && !is_prismatic
    }

    /// The least and the greatest position that the URDF gives joint `joint`, rad or m.
    #[must_use]
    pub fn limits(&self, joint: usize) -> Option<[f64; 2]> {
        self.joints[joint].limits
    }

    /// The unit of the positions of joint `joint`.
    #[must_use]
    pub fn unit(&self, joint: usize) -> &'static str {
        if self.joints[joint].is_prismatic { "m" } else { "rad" }
    }

    /// Whether joint `joint` turns without end, so that 0 and 2π are one position.
    #[must_use]
    pub fn is_continuous(&self, joint: usize) -> bool {
        self.joints[joint].is_continuous
    }

    /// Each link's pose in its root's frame, by the joints' `positions` (rad or m): root_from_link. Links below a floating
    /// or planar joint are where that joint's origin has them.
    ///
    /// # Panics
    /// Unless there is a position for each of [`Kinematics::joint_names`].
    #[must_use]
    pub fn link_poses(&self, positions: &[f64]) -> Vec<(&str, DAffine3)> {
        assert_eq!(positions.len(), self.joints.len(), "each joint has a position");
        let mut poses = Vec::new();
        let given = |link: usize| matches!(self.links[link].drive, Drive::Free).then_some(None);
        self.poses_into(|joint| Some(positions[joint]), given, &DAffine3::IDENTITY, &mut poses);
        self.link_names().zip(poses.into_iter().map(Option::unwrap_or_default)).collect()
    }

    /// Puts the pose of each link in the world into `poses`: world_from_link, `None` where it is not known.
    ///
    /// `position_of` gives a joint's position, if known. `given` says for a link: `Some(Some(pose))` where it is known in the
    /// world, `Some(None)` where it is to be taken as at rest against its parent, `None` where joints say it. Roots that are
    /// not given are at `world_from_root`.
    pub(super) fn poses_into(
        &self,
        position_of: impl Fn(usize) -> Option<f64>,
        given: impl Fn(usize) -> Option<Option<DAffine3>>,
        world_from_root: &DAffine3,
        poses: &mut Vec<Option<DAffine3>>,
    ) {
        poses.clear();
        for (index, link) in self.links.iter().enumerate() {
            let above = link.parent.map_or(Some(*world_from_root), |parent| poses[parent]);
            let at_rest = above.map(|above| above * link.parent_from_link);
            let pose = match given(index) {
                Some(Some(pose)) => Some(pose),
                Some(None) => at_rest,
                None => match &link.drive {
                    Drive::Nothing => at_rest,
                    Drive::Free => None,
                    Drive::Joint { joint, multiplier, offset, motion } => position_of(*joint)
                        .zip(at_rest)
                        .map(|(position, at_rest)| at_rest * moved(*motion, multiplier * position + offset)),
                },
            };
            poses.push(pose);
        }
    }

    /// Each link where every joint is at 0, also those that mimic others: where authoring puts it.
    pub(super) fn rest_poses(&self, world_from_root: &DAffine3) -> Vec<DAffine3> {
        let mut poses = Vec::new();
        self.poses_into(|_| None, |_| Some(None), world_from_root, &mut poses);
        poses.into_iter().map(Option::unwrap_or_default).collect()
    }

    /// Whether the URDF has a joint called `name`, of any kind.
    pub(super) fn has_joint(&self, name: &str) -> bool {
        self.joint_names().any(|known| known == name) || self.other_joints.iter().any(|known| known == name)
    }

    /// The joints that move `link` against its root.
    pub(super) fn joints_above(&self, link: usize) -> Vec<usize> {
        let mut at = Some(link);
        let mut joints = Vec::new();
        while let Some(index) = at {
            if let Drive::Joint { joint, .. } = self.links[index].drive {
                joints.push(joint);
            }
            at = self.links[index].parent;
        }
        joints
    }
}

/// Where a joint at `position` takes its child.
fn moved(motion: JointMotion, position: f64) -> DAffine3 {
    match motion {
        JointMotion::Fixed | JointMotion::Free => DAffine3::IDENTITY,
        JointMotion::Revolute { axis, .. } => {
            DAffine3::from_rotation_translation(DQuat::from_axis_angle(axis, position), DVec3::ZERO)
        }
        JointMotion::Prismatic { axis } => DAffine3::from_translation(axis * position),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    const ARM: &str = r#"<robot name="r"><link name="hand"/><link name="base"/><link name="arm"/><link name="left"/>
        <link name="right"/><link name="ball"/>
        <joint name="slide" type="prismatic"><parent link="hand"/><child link="left"/><axis xyz="0 3 0"/></joint>
        <joint name="follow" type="prismatic"><parent link="hand"/><child link="right"/><axis xyz="0 1 0"/>
          <mimic joint="slide" multiplier="-2" offset="0.1"/></joint>
        <joint name="shoulder" type="continuous"><parent link="base"/><child link="arm"/><origin xyz="0 0 1"/><axis xyz="0 0 1"/></joint>
        <joint name="wrist" type="fixed"><parent link="arm"/><child link="hand"/><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/></joint>
        <joint name="free" type="floating"><parent link="hand"/><child link="ball"/><origin xyz="0 0 2"/></joint></robot>"#;

    fn place(robot: &Kinematics, link: &str, positions: &[f64]) -> DVec3 {
        robot.link_poses(positions).into_iter().find(|(name, _)| *name == link).unwrap().1.translation
    }

    #[test]
    fn joints_move_what_hangs_on_them() {
        let robot = Kinematics::from_urdf("r", ARM).unwrap();
        assert_eq!(robot.joint_names().collect::<Vec<_>>(), ["slide", "shoulder"]);
        assert!(robot.is_continuous(1) && !robot.is_continuous(0));
        let at = |link: &str| place(&robot, link, &[0.25, FRAC_PI_2]);
        let is_at = |place: DVec3, x, y, z| assert!(place.distance(DVec3::new(x, y, z)) < 1e-15, "{place}");
        is_at(at("hand"), 0.0, 1.0, 1.0);
        // The hand's y points against the base's x rotated twice by 90°.
        is_at(at("left"), 0.0, 1.0 - 0.25, 1.0);
        is_at(at("right"), 0.0, 1.0 - (-2.0 * 0.25 + 0.1), 1.0);
        is_at(at("ball"), 0.0, 1.0, 3.0);
        // At rest, a joint that mimics is at 0, too.
        let rest = robot.rest_poses(&DAffine3::IDENTITY);
        let right = robot.link_names().position(|name| name == "right").unwrap();
        is_at(rest[right].translation, 1.0, 0.0, 1.0);
    }

    #[test]
    fn what_is_not_known_is_not_guessed() {
        let robot = Kinematics::from_urdf("r", ARM).unwrap();
        let mut poses = Vec::new();
        robot.poses_into(|joint| (joint == 0).then_some(0.0), |_| None, &DAffine3::IDENTITY, &mut poses);
        let known = |poses: &[Option<DAffine3>]| -> Vec<&str> {
            robot.link_names().zip(poses).filter(|(_, pose)| pose.is_some()).map(|(name, _)| name).collect()
        };
        assert_eq!(known(&poses), ["base"]);
        // A pose of the hand places the hand and the links below it.
        let hand = robot.link_names().position(|name| name == "hand").unwrap();
        let given = |link: usize| (link == hand).then_some(Some(DAffine3::from_translation(DVec3::X)));
        robot.poses_into(|joint| (joint == 0).then_some(0.5), given, &DAffine3::IDENTITY, &mut poses);
        assert_eq!(known(&poses), ["base", "hand", "left", "right"]);
        let left = robot.link_names().position(|name| name == "left").unwrap();
        assert_eq!(poses[left].unwrap().translation, DVec3::new(1.0, 0.5, 0.0));
        assert_eq!(robot.joints_above(left), [0, 1]);
    }

    #[test]
    fn what_is_wrong_is_reported_with_its_line() {
        let why = |from: &str, to: &str| {
            assert!(ARM.contains(from));
            Kinematics::from_urdf("r.urdf", &ARM.replace(from, to)).unwrap_err().to_string()
        };
        assert!(
            why("mimic joint=\"slide\"", "mimic joint=\"wrist\"")
                .starts_with("r.urdf: line 4: `follow` mimics `wrist`")
        );
        assert!(why("mimic joint=\"slide\"", "mimic joint=\"follow\"").ends_with("`follow` mimics itself"));
        assert!(why("name=\"wrist\"", "name=\"slide\"").contains("two joints are called `slide`"));
        assert!(why("type=\"continuous\"", "type=\"hinge\"").contains("a joint of type `hinge`"));
        assert!(why("xyz=\"0 3 0\"", "xyz=\"0 0 0\"").contains("has no direction"));
        assert!(why("child link=\"ball\"", "child link=\"bell\"").contains("no link `bell`"));
    }
}
