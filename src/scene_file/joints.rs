//! What a scene asks of a robot's joints.

use super::{JointsDelay, SceneFile, StatesSpec, bag_of};
use crate::error::{Error, Result};
use crate::source::{BagName, SourceSpec};

impl SceneFile {
    /// Where the joints' states come from: what is named, or the bag that the frames come from; `None` if they are in the frames.
    ///
    /// # Errors
    /// A usage error if what is named is not a topic or a bag.
    pub fn states(&self) -> Result<Option<StatesSpec>> {
        if let Some(states) = &self.joint_states {
            return StatesSpec::named(states).map(Some);
        }
        // Frames of a bag carry no joints, and the bag has them beside.
        Ok(match self.sources.first() {
            Some(SourceSpec::Ros2Mcap(bag)) => Some(StatesSpec::Bag(BagName::new(&bag.path))),
            _ => None,
        })
    }

    pub(super) fn check_joints(&self) -> Result<()> {
        self.check_poses()?;
        let given = [
            ("joint_states", self.joint_states.is_some()),
            ("up", self.up.is_some()),
            ("joints_delay_s", self.joints_delay_s.is_some()),
            ("joints_max_age_s", self.joints_max_age_s.is_some() && self.poses.is_none()),
        ];
        if self.joints.is_none() {
            return match given.into_iter().find(|(_, given)| *given) {
                Some((key, _)) => {
                    Err(Error::usage(format!("`{key}` is for a robot's joints; add `joints = \"robot.urdf\"`")))
                }
                None => Ok(()),
            };
        }
        let states = self.states()?;
        let carries_joints =
            |source: &SourceSpec| matches!(source, SourceSpec::Stdin | SourceSpec::Ndjson(_) | SourceSpec::Mcap(_));
        if states.is_none() && !self.sources.iter().any(carries_joints) {
            return Err(Error::usage(
                "frames of this source carry no joint states; give a recording of them: `joint_states = \"FILE\"`, a CSV under \
                 t,<joint>,..., NDJSON or a ROS 2 bag",
            ));
        }
        if states.is_some() && self.repeat.is_some() {
            return Err(Error::usage(
                "`loop` lets the time of frames go on, and the recording of joint states ends; leave `loop` out",
            ));
        }
        self.check_delay(states.as_ref())?;
        if let Some(age) = self.joints_max_age_s.filter(|age| age.is_nan() || *age < 0.0) {
            return Err(Error::usage(format!("`joints_max_age_s = {age}` is not a time span; give seconds from 0")));
        }
        Ok(())
    }

    /// Whether poses can be had of the bag that is named.
    fn check_poses(&self) -> Result<()> {
        let Some(poses) = &self.poses else { return Ok(()) };
        bag_of(poses)?;
        if self.repeat.is_some() {
            return Err(Error::usage(
                "`loop` lets the time of frames go on, and the bag of `poses` ends; leave `loop` out",
            ));
        }
        Ok(())
    }

    /// Whether what is asked for can be had, where the joints come from `states`.
    fn check_delay(&self, states: Option<&StatesSpec>) -> Result<()> {
        let refuse = |what: &str| Err(Error::usage(what));
        match (self.joints_delay_s, states) {
            (None, _) | (Some(JointsDelay::Seconds(_)), Some(_)) => Ok(()),
            (Some(JointsDelay::Auto), Some(StatesSpec::Topic(_))) => refuse(
                "`joints_delay_s = \"auto\"` is not for live topics; estimate it once from a bag of both, and give it in seconds",
            ),
            (Some(_), None) => {
                refuse("`joints_delay_s` is for `joint_states`; states in frames have the frame's own time")
            }
            (Some(JointsDelay::Auto), Some(StatesSpec::File(_))) => refuse(
                "`joints_delay_s = \"auto\"` compares stamps with arrivals, and this file of `joint_states` has no arrivals; give both \
                 from one bag, `joint_states = \"BAG\"` and `source = \"ros2-mcap:BAG\"`, or the delay in seconds",
            ),
            (Some(JointsDelay::Auto), Some(StatesSpec::Bag(_))) => match self.sources.first() {
                Some(SourceSpec::Ros2Mcap(_)) => Ok(()),
                _ => refuse(
                    "`joints_delay_s = \"auto\"` compares stamps with arrivals, and frames of this source have no arrivals; give both \
                     from one bag, `source = \"ros2-mcap:BAG\"` and `joint_states = \"BAG\"`, or the delay in seconds",
                ),
            },
        }
    }
}
