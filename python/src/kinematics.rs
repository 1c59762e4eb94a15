//! Where a body's links are, from the positions of its joints.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DAffine3, DQuat};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use somatic::Body;
use somatic::body::Link;
use somatic::internal::body::{LinkMotion, WORLD_FROM_BODY};
use somatic::internal::error::suggestion;
use somatic::signal::Pose;

use crate::arrays::{doubles, shown};
use crate::error::{unknown_name, usage};

/// Joints of a body that move on their own, by name their link.
pub(crate) fn joints(body: &Body) -> Vec<(&str, usize)> {
    let links = body.links.iter().enumerate();
    links.filter_map(|(link, of)| Some((named(of)?, link))).collect()
}

/// The name of the joint that moves `link` on its own.
fn named(link: &Link) -> Option<&str> {
    let joint = link.joint.as_ref().filter(|joint| joint.mimic.is_none() && !joint.name.is_empty());
    joint.map(|joint| joint.name.as_str())
}

/// The positions of joints over frames.
pub(crate) struct Positions {
    /// By joint, one for each frame.
    of: BTreeMap<String, Vec<f64>>,
}

impl Positions {
    /// Those in `any`, a dict of joints of `body` to a position or one for each of `frames` frames.
    pub(crate) fn new(any: &Bound<'_, PyAny>, body: &Body, frames: Option<usize>) -> PyResult<(Self, Option<usize>)> {
        let py = any.py();
        let wrong =
            |what: String| usage(py, format!("joints should be a dict of names to positions, in rad or m; {what}"));
        let dict = any.cast::<PyDict>().map_err(|_| wrong("this is no dict".to_owned()))?;
        let own = joints(body);
        let mut given = Vec::new();
        let mut length = frames;
        for (name, positions) in dict.iter() {
            let name: String = name.extract().map_err(|_| wrong("a key is no text".to_owned()))?;
            if !own.iter().any(|(known, _)| *known == name) {
                return Err(unknown_name(py, why_not(body, &own, &name)));
            }
            let (positions, shape) = doubles(&positions, &format!("joints: `{name}`"))?;
            if let Some(frame) = positions.iter().position(|position| !position.is_finite()) {
                return Err(wrong(format!("that of `{name}` at frame {frame} is not finite; leave such frames out")));
            }
            match (&shape[..], length) {
                ([], _) => {}
                ([count], Some(length)) if *count != length => {
                    return Err(wrong(format!(
                        "those of `{name}` should have shape [] or [{length}], and have {}",
                        shown(&shape)
                    )));
                }
                ([count], _) => length = Some(*count),
                _ => return Err(wrong(format!("those of `{name}` have shape {}", shown(&shape)))),
            }
            given.push((name, positions));
        }
        let frames = length.unwrap_or(1);
        let repeated = given.into_iter().map(|(name, positions)| match positions[..] {
            [one] if frames != 1 => (name, vec![one; frames]),
            _ => (name, positions),
        });
        Ok((Self { of: repeated.collect() }, length))
    }

    /// The position of the joint of `link` in `frame`, if it is known; of a link that follows another's that one's.
    fn at(&self, body: &Body, link: usize, frame: usize) -> Option<f64> {
        let (mut joint, mut multiplier, mut offset) = (body.links[link].joint.as_ref()?, 1.0, 0.0);
        for _ in 0..body.links.len() {
            let Some(mimic) = &joint.mimic else {
                return self.of.get(&joint.name).map(|positions| multiplier * positions[frame] + offset);
            };
            offset += multiplier * mimic.offset;
            multiplier *= mimic.multiplier;
            joint = body.links.iter().filter_map(|link| link.joint.as_ref()).find(|other| other.name == mimic.joint)?;
        }
        None
    }

    /// The pose of each link of `body` in the world, frame by frame, where it is known; `given` are poses of links that are known
    /// otherwise; links below them start from there.
    pub(crate) fn poses(&self, body: &Body, frames: usize, given: &[(String, Vec<Pose>)]) -> Vec<(String, Vec<Pose>)> {
        let rest = |link: usize| {
            let own = body.links[link].body_from_link;
            body.links[link]
                .parent
                .map_or(WORLD_FROM_BODY * own, |parent| body.links[parent].body_from_link.inverse() * own)
        };
        let rests: Vec<DAffine3> = (0..body.links.len()).map(rest).collect();
        let given: Vec<Option<&Vec<Pose>>> = body
            .links
            .iter()
            .map(|link| given.iter().find(|(name, _)| *name == link.name).map(|(_, poses)| poses))
            .collect();
        let mut found: Vec<Option<Vec<Pose>>> = vec![Some(Vec::with_capacity(frames)); body.links.len()];
        for frame in 0..frames {
            let mut at: Vec<Option<DAffine3>> = Vec::with_capacity(body.links.len());
            for (link, of) in body.links.iter().enumerate() {
                let above = of.parent.map_or(Some(DAffine3::IDENTITY), |parent| at[parent]);
                let moved = match &of.joint {
                    None => Some(DAffine3::IDENTITY),
                    Some(joint) => self.at(body, link, frame).map(|position| LinkMotion::at(joint.motion, position)),
                };
                let pose = match given[link] {
                    Some(poses) => {
                        Some(DAffine3::from_rotation_translation(poses[frame].rotation, poses[frame].translation))
                    }
                    None => above.zip(moved).map(|(above, moved)| above * rests[link] * moved),
                };
                let made = pose.map(|pose| Pose {
                    translation: pose.translation,
                    rotation: DQuat::from_mat3(&pose.matrix3).normalize(),
                });
                match (made, &mut found[link]) {
                    (Some(made), Some(poses)) => poses.push(made),
                    (_, poses) => *poses = None,
                }
                at.push(pose);
            }
        }
        let names = body.links.iter().map(|link| link.name.clone());
        names.zip(found).filter_map(|(name, poses)| Some((name, poses?))).collect()
    }

    /// Refuses positions without which the place of a link with taxels is not known, unless it is among `poses`.
    pub(crate) fn check(&self, py: Python<'_>, body: &Body, poses: &[(String, Vec<Pose>)]) -> PyResult<()> {
        let carriers: BTreeSet<usize> = body.taxels.iter().map(|taxel| taxel.link).collect();
        for link in carriers {
            let name = &body.links[link].name;
            if poses.iter().any(|(known, _)| known == name) {
                continue;
            }
            let path = body.path_from_root(link);
            let missing =
                path.iter().rev().find(|&&link| body.links[link].joint.is_some() && self.at(body, link, 0).is_none());
            let joint = missing.and_then(|&link| body.links[link].joint.as_ref());
            let joint = joint.map_or("", |joint| joint.mimic.as_ref().map_or(&joint.name[..], |mimic| &mimic.joint));
            return Err(usage(
                py,
                format!(
                    "joints: there is no position of `{joint}`, which moves `{name}`; give it too, or the pose of `{name}`"
                ),
            ));
        }
        Ok(())
    }
}

/// Why the joint called `name` is not taken.
fn why_not(body: &Body, own: &[(&str, usize)], name: &str) -> String {
    let all = body.links.iter().filter_map(|link| link.joint.as_ref());
    if let Some(mimic) = all.filter(|joint| joint.name == name).find_map(|joint| joint.mimic.as_ref()) {
        return format!("joint `{name}` follows `{}`; leave it out", mimic.joint);
    }
    match own {
        [] => "the body has no joints; make one from a URDF, as by `author(\"robot.urdf\", taxels=500)`, or give poses of its links".to_owned(),
        _ => format!("there is no joint `{name}`; {}", suggestion(name, own.iter().map(|(name, _)| *name))),
    }
}
