//! Poses of a body in which taxels are looked for: at rest, and with joints drawn at random.

use std::collections::BTreeMap;

use glam::DAffine3;

use super::super::random::Random;
use crate::body::{Body, LinkJoint, LinkMotion};

/// Poses beside that at rest.
const DRAWN: usize = 4;

/// Seed of the positions.
const SEED: u64 = 0x5e1f;

/// Where each link of a body is, in several poses.
#[derive(Clone, Debug)]
pub struct DrawnPoses {
    /// By pose, body_from_link of every link; the first is the body at rest.
    pub(super) body_from_link: Vec<Vec<DAffine3>>,
}

impl DrawnPoses {
    /// Poses of `body` with its own joints, drawn evenly within their limits by a fixed seed. A joint that turns and has no
    /// limits is within ±π, one that slides and has none stays at 0. `None` if it keeps no joints.
    #[must_use]
    pub fn of_own_joints(body: &Body) -> Option<Self> {
        if body.links.iter().all(|link| link.joint.is_none()) {
            return None;
        }
        Some(Self::draw(body, |random| {
            let positions = positions(body, random);
            let mut poses: Vec<DAffine3> = Vec::with_capacity(body.links.len());
            for (link, position) in body.links.iter().zip(positions) {
                let moved = link.joint.as_ref().map_or(DAffine3::IDENTITY, |joint| joint.motion.at(position));
                let at_rest = match link.parent {
                    Some(parent) => poses[parent] * body.links[parent].body_from_link.inverse() * link.body_from_link,
                    None => link.body_from_link,
                };
                poses.push(at_rest * moved);
            }
            poses
        }))
    }

    /// Poses of `body` with its own joints; rest alone if it keeps none.
    pub(crate) fn from_body(body: &Body) -> Self {
        Self::of_own_joints(body).unwrap_or_else(|| Self::at_rest(body))
    }

    /// By pose, body_from_link of link `link`.
    pub fn of_link(&self, link: usize) -> impl Iterator<Item = DAffine3> + '_ {
        self.body_from_link.iter().map(move |pose| pose[link])
    }

    /// Rest alone.
    pub(super) fn at_rest(body: &Body) -> Self {
        Self { body_from_link: vec![body.links.iter().map(|link| link.body_from_link).collect()] }
    }

    /// The poses of `body` that `draw` gives: body_from_link of every link.
    pub fn draw(body: &Body, mut draw: impl FnMut(&mut Random) -> Vec<DAffine3>) -> Self {
        let mut random = Random::new(SEED);
        let at_rest = body.links.iter().map(|link| link.body_from_link).collect();
        let drawn = (0..DRAWN).map(|_| draw(&mut random));
        Self { body_from_link: std::iter::once(at_rest).chain(drawn).collect() }
    }
}

/// A position of a joint within its range, rad or m.
#[cfg_attr(not(feature = "meshes"), allow(unreachable_pub, reason = "robots alone ask for it from outside"))]
pub fn drawn_position(limits: Option<[f64; 2]>, is_turn: bool, random: &mut Random) -> f64 {
    let share = random.unit();
    let turn = [-std::f64::consts::PI, std::f64::consts::PI];
    let [least, greatest] = limits.unwrap_or(if is_turn { turn } else { [0.0; 2] });
    least + share * (greatest - least)
}

/// By link, the position of its joint.
fn positions(body: &Body, random: &mut Random) -> Vec<f64> {
    let by_name: BTreeMap<&str, usize> = body
        .links
        .iter()
        .enumerate()
        .filter_map(|(index, link)| Some((link.joint.as_ref()?.name.as_str(), index)))
        .collect();
    let own: Vec<f64> = body
        .links
        .iter()
        .map(|link| match &link.joint {
            Some(LinkJoint { motion, limits, mimic: None, .. }) => {
                drawn_position(*limits, !matches!(motion, LinkMotion::Prismatic(_)), random)
            }
            _ => 0.0,
        })
        .collect();
    let follow = |link: usize| {
        // A joint that is followed may follow another; a ring, or an unknown one, stays at rest.
        let (mut at, mut multiplier, mut offset) = (link, 1.0, 0.0);
        for _ in 0..=body.links.len() {
            let joint = body.links[at].joint.as_ref()?;
            let Some(mimic) = &joint.mimic else { return Some(multiplier * own[at] + offset) };
            offset += multiplier * mimic.offset;
            multiplier *= mimic.multiplier;
            at = *by_name.get(mimic.joint.as_str())?;
        }
        None
    };
    (0..body.links.len()).map(|link| follow(link).unwrap_or(0.0)).collect()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::body::{Link, LinkMimic};

    fn body(joints: Vec<Option<LinkJoint>>) -> Body {
        let links = joints.into_iter().enumerate().map(|(index, joint)| Link {
            name: format!("l{index}"),
            parent: index.checked_sub(1),
            body_from_link: DAffine3::from_translation(DVec3::X * index as f64),
            link_from_node: DAffine3::IDENTITY,
            joint,
            urdf_up: None,
        });
        Body {
            name: "b".into(),
            links: links.collect(),
            surfaces: Vec::new(),
            taxels: Vec::new(),
            fields: Vec::new(),
            edges: None,
            findings: Vec::new(),
            kept: Default::default(),
        }
    }

    fn slide(name: &str, limits: Option<[f64; 2]>, mimic: Option<LinkMimic>) -> Option<LinkJoint> {
        Some(LinkJoint { name: name.into(), motion: LinkMotion::Prismatic(DVec3::Y), limits, mimic })
    }

    #[test]
    fn joints_stay_within_their_limits_and_followers_follow() {
        let mimic = |joint: &str, multiplier, offset| Some(LinkMimic { joint: joint.into(), multiplier, offset });
        let body = body(vec![
            None,
            slide("a", Some([2.0, 3.0]), None),
            slide("b", None, mimic("c", -2.0, 0.5)),
            slide("c", Some([-1.0, 0.0]), mimic("a", 1.0, 1.0)),
            slide("ring", None, mimic("ring", 1.0, 1.0)),
            slide("free", None, None),
        ]);
        let poses = DrawnPoses::of_own_joints(&body).unwrap();
        assert_eq!(poses.body_from_link.len(), 5);
        let mut seen = Vec::new();
        for (index, pose) in poses.body_from_link.iter().enumerate() {
            let y: Vec<f64> = pose.iter().map(|link| link.translation.y).collect();
            if index == 0 {
                assert!(y.iter().all(|y| *y == 0.0));
                continue;
            }
            let a = y[1];
            assert!((2.0..3.0).contains(&a), "{a}");
            seen.push(a);
            let expected = [0.0, a, a - 2.0 * (a + 1.0) + 0.5];
            assert!(expected.iter().zip(&y).all(|(e, y)| (e - y).abs() < 1e-12), "{y:?}");
            assert!((y[3] - y[2] - (a + 1.0)).abs() < 1e-12);
            assert_eq!((y[4], y[5]), (y[3], y[3]));
        }
        seen.dedup();
        assert_eq!(seen.len(), 4);
        let again = DrawnPoses::of_own_joints(&body).unwrap();
        assert_eq!(poses.body_from_link, again.body_from_link);
        assert!(DrawnPoses::of_own_joints(&self::body(vec![None, None])).is_none());
    }
}
