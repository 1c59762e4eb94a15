//! The tree that a URDF's joints make of its links, checked as urdfdom does, and which joints follow others.

use std::collections::{BTreeMap, HashMap};

use super::urdf_file::{JointMotion, Robot, RobotJoint, RobotLink};
use crate::error::{Error, Result, failed};
use crate::limits::MAX_NODE_DEPTH;

/// The links, a parent before its children, each with the joint to its parent.
///
/// # Errors
/// Names are there twice or lead nowhere, or the links are not a tree with one root, or a joint follows itself.
pub fn order(robot: &Robot) -> Result<Vec<(&RobotLink, Option<&RobotJoint>)>> {
    let mut index_of = HashMap::new();
    for (index, link) in robot.links.iter().enumerate() {
        if index_of.insert(link.name.as_str(), index).is_some() {
            return Err(failed!("two links are called `{}`", link.name));
        }
    }
    let mut above: Vec<Option<&RobotJoint>> = vec![None; robot.links.len()];
    let mut below: Vec<Vec<usize>> = vec![Vec::new(); robot.links.len()];
    for joint in &robot.joints {
        let at = |what: String| Error::failed(what).at(format!("line {}", joint.line));
        let index = |name: &str| index_of.get(name).copied().ok_or_else(|| at(format!("there is no link `{name}`")));
        let (parent, child) = (index(&joint.parent)?, index(&joint.child)?);
        if above[child].replace(joint).is_some() {
            return Err(at(format!("`{}` is the child of two joints; a link has one parent", joint.child)));
        }
        below[parent].push(child);
    }
    let roots: Vec<usize> = (0..robot.links.len()).filter(|&index| above[index].is_none()).collect();
    if let [first, second, ..] = roots[..] {
        let [first, second] = [first, second].map(|index| &robot.links[index].name);
        return Err(failed!("it has two roots, `{first}` and `{second}`; a robot is one tree: join them by a joint"));
    }
    // Links are in the order of the file, but for those whose parent comes later: these wait for the next round.
    let mut placed: Vec<(usize, usize, usize)> = roots.iter().map(|&root| (0, root, 0)).collect();
    let mut next = 0;
    while let Some(&(round, index, depth)) = placed.get(next) {
        if depth > MAX_NODE_DEPTH {
            return Err(failed!("its links are nested over {MAX_NODE_DEPTH} deep; split the robot"));
        }
        placed.extend(below[index].iter().map(|&child| (round + usize::from(child < index), child, depth + 1)));
        next += 1;
    }
    if placed.len() < robot.links.len() {
        return Err(Error::failed("its joints go round in a ring; a link cannot be above itself"));
    }
    placed.sort_unstable();
    drivers(robot, false)?;
    Ok(placed.into_iter().map(|(_, index, _)| (&robot.links[index], above[index])).collect())
}

/// What drives a joint: its position is `multiplier` · that of joint `joint` + `offset`.
#[derive(Clone, Copy, Debug)]
pub struct Driver {
    /// The joint that drives, by its number in the file.
    pub joint: usize,
    /// The position driven per position of `joint`.
    pub multiplier: f64,
    /// The position driven where that of `joint` is 0, rad or m.
    pub offset: f64,
}

impl RobotJoint {
    /// Whether one number says where its child is.
    pub fn is_driven(&self) -> bool {
        matches!(self.motion, JointMotion::Revolute { .. } | JointMotion::Prismatic { .. })
    }
}

/// What drives each of the robot's joints: itself, or the joint that it mimics in the end.
///
/// # Errors
/// Two joints have one name, or one mimics itself, or what does not move.
pub fn followed(robot: &Robot) -> Result<Vec<Driver>> {
    drivers(robot, true)
}

/// The same; unless `all_move`, a joint that mimics what is not there stands for itself, as in authoring nothing moves.
fn drivers(robot: &Robot, all_move: bool) -> Result<Vec<Driver>> {
    let at = |joint: &RobotJoint, what: String| Error::failed(what).at(format!("line {}", joint.line));
    let mut by_name = BTreeMap::new();
    for (index, joint) in robot.joints.iter().enumerate() {
        if by_name.insert(joint.name.as_str(), index).is_some() {
            return Err(at(joint, format!("two joints are called `{}`", joint.name)));
        }
    }
    let mut drivers: Vec<Option<Driver>> = vec![None; robot.joints.len()];
    for first in 0..robot.joints.len() {
        // A joint that mimics may be mimicked itself: down to one whose driver is known, and back.
        let mut chain = Vec::new();
        let mut index = first;
        let mut driver = loop {
            if let Some(known) = drivers[index] {
                break known;
            }
            let joint = &robot.joints[index];
            let own = Driver { joint: index, multiplier: 1.0, offset: 0.0 };
            let Some(mimic) = joint.mimic.as_ref().filter(|_| joint.is_driven()) else {
                drivers[index] = Some(own);
                break own;
            };
            if chain.len() > robot.joints.len() {
                return Err(at(joint, format!("`{}` mimics itself", joint.name)));
            }
            match by_name.get(mimic.joint.as_str()).filter(|&&other| robot.joints[other].is_driven()) {
                Some(&other) => {
                    chain.push((index, mimic));
                    index = other;
                }
                None if all_move => {
                    let what = format!("`{}` mimics `{}`, which is not a joint that moves", joint.name, mimic.joint);
                    return Err(at(joint, what));
                }
                None => {
                    drivers[index] = Some(own);
                    break own;
                }
            }
        };
        for (index, mimic) in chain.into_iter().rev() {
            driver = Driver {
                joint: driver.joint,
                multiplier: mimic.multiplier * driver.multiplier,
                offset: mimic.multiplier * driver.offset + mimic.offset,
            };
            drivers[index] = Some(driver);
        }
    }
    Ok(drivers.into_iter().flatten().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(text: &str) -> Result<Vec<String>> {
        let robot = Robot::joints_of(text)?;
        Ok(order(&robot)?.into_iter().map(|(link, _)| link.name.clone()).collect())
    }

    fn joint(name: &str, parent: &str, child: &str, mimic: &str) -> String {
        format!(
            "\n<joint name=\"{name}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/>{mimic}</joint>"
        )
    }

    #[test]
    fn parents_come_first_and_else_the_order_is_that_of_the_file() {
        let links = |names: &str| names.chars().map(|name| format!("<link name=\"{name}\"/>")).collect::<String>();
        let joints = [("1", "d", "a"), ("2", "a", "c"), ("3", "d", "b"), ("4", "b", "e")]
            .map(|(name, parent, child)| joint(name, parent, child, ""))
            .concat();
        let text = format!("<robot>{}{joints}</robot>", links("abcde"));
        assert_eq!(names(&text).unwrap(), ["d", "a", "b", "c", "e"].map(str::to_owned));
        let two = format!("<robot>{}{joints}</robot>", links("abcdef"));
        assert!(names(&two).unwrap_err().to_string().starts_with("it has two roots, `d` and `f`"));
        let ring = format!("<robot>{}{joints}{}</robot>", links("abcde"), joint("5", "c", "d", ""));
        assert!(names(&ring).unwrap_err().to_string().contains("ring"));
    }

    #[test]
    fn a_long_chain_is_refused_and_a_shorter_one_takes_no_time() {
        let chain = |length: usize| {
            let links: String = (0..length).rev().map(|index| format!("<link name=\"{index}\"/>")).collect();
            let joints: String = (1..length)
                .map(|index| joint(&format!("j{index}"), &(index - 1).to_string(), &index.to_string(), ""))
                .collect();
            format!("<robot>{links}{joints}</robot>")
        };
        assert_eq!(names(&chain(MAX_NODE_DEPTH)).unwrap().len(), MAX_NODE_DEPTH);
        assert!(names(&chain(20_000)).unwrap_err().to_string().contains("are nested over"));
    }

    #[test]
    fn a_joint_that_mimics_itself_is_refused_however_far_round() {
        let count = 3000;
        let robot = |last: &str| {
            let links: String = (0..=count).map(|index| format!("<link name=\"{index}\"/>")).collect();
            let joints: String = (1..=count)
                .map(|index| {
                    let other = if index == count { last.to_owned() } else { format!("j{}", index + 1) };
                    let mimic = format!("<mimic joint=\"{other}\" multiplier=\"-1\" offset=\"1\"/>");
                    let mimic = if other.is_empty() { String::new() } else { mimic };
                    joint(&format!("j{index}"), "0", &index.to_string(), &mimic)
                })
                .collect();
            format!("<robot>{links}{joints}</robot>")
        };
        let whole = Robot::joints_of(&robot("")).unwrap();
        let drivers = followed(&whole).unwrap();
        assert!(drivers.iter().all(|driver| driver.joint == count - 1));
        assert_eq!((drivers[count - 2].multiplier, drivers[count - 2].offset), (-1.0, 1.0));
        assert_eq!((drivers[count - 3].multiplier, drivers[count - 3].offset), (1.0, 0.0));
        for last in ["j3000", "j1", "j2000"] {
            let why = names(&robot(last)).unwrap_err().to_string();
            assert!(why.contains("line ") && why.ends_with("mimics itself"), "{why}");
        }
        let stray = robot("no");
        assert_eq!(names(&stray).unwrap().len(), count + 1);
        let why = followed(&Robot::joints_of(&stray).unwrap()).unwrap_err().to_string();
        assert!(why.ends_with("mimics `no`, which is not a joint that moves"), "{why}");
    }
}
