//! Joints that move the body's links.

use super::Setup;
use crate::body::{Body, Up};
use crate::error::{Error, Result};
use crate::robot::{DelayEstimate, JointOptions, JointedSource, Kinematics, PosedSource, poses_of_bag};
use crate::scene_file::{JointsDelay, StatesSpec, bag_of};
use crate::source::{JointStates, Source, SourceSpec};

/// What is added where nothing says which axis points up in the URDF.
const Z_IS_ASSUMED: &str = "; its z counts as up, as in REP 103; if its y is up, give `up = \"y\"`";

impl Setup {
    /// The delay to use, s, if the joints come from `states`; an estimate is reported.
    fn delay_s(&self, states: Option<&StatesSpec>) -> Result<f64> {
        match self.joints_delay_s {
            None => Ok(0.0),
            Some(JointsDelay::Seconds(seconds)) => Ok(seconds),
            Some(JointsDelay::Auto) => {
                let (Some(StatesSpec::Bag(joints)), Some(SourceSpec::Ros2Mcap(frames))) =
                    (states, self.sources.first())
                else {
                    return Err(Error::usage(
                        "`joints_delay_s = \"auto\"` is for frames and joint states from one bag",
                    ));
                };
                let estimate = DelayEstimate::of_bags(frames, joints)?;
                self.tell.say(&format!("{}: {estimate}", joints.path.display()));
                Ok(estimate.delay_s())
            }
        }
    }

    /// `source`, with poses of the links of `body` from the transforms of a bag, where these are asked for.
    fn posed(&self, source: Box<dyn Source + Send>, body: &Body) -> Result<Box<dyn Source + Send>> {
        let Some(bag) = &self.poses else { return Ok(source) };
        let poses = poses_of_bag(&bag_of(bag)?)?;
        let posed = PosedSource::new(source, poses, body, self.joints_max_age_s)?;
        self.tell.say(posed.summary());
        Ok(Box::new(posed))
    }

    /// `source`, with poses of the links of `body` where joints are asked for.
    pub fn jointed(&self, source: Box<dyn Source + Send>, body: &Body) -> Result<Box<dyn Source + Send>> {
        let source = self.posed(source, body)?;
        let Some(urdf) = &self.joints else { return Ok(source) };
        let known_up = self.up.or_else(|| body.urdf_up());
        let robot = Kinematics::load(urdf)?;
        let mut options = JointOptions::new(known_up.unwrap_or(Up::Z));
        let states = self.states()?;
        options.delay_s = self.delay_s(states.as_ref())?;
        let source = match states {
            None => source,
            Some(StatesSpec::Topic(topic)) => {
                let is_stamped = matches!(self.sources.first(), Some(SourceSpec::Ros2 { .. }));
                live(source, &topic, self.joints_delay_s.is_some().then_some(options.delay_s), is_stamped)?
            }
            Some(StatesSpec::Bag(bag)) => {
                let failed = |e: Error| match self.joint_states {
                    Some(_) => e,
                    None => Error::failed(format!(
                        "{e}; or name another file with joint states (joint_states, --joint-states FILE)"
                    )),
                };
                let states = crate::robot::joint_states_of_bag(&bag, self.skip_bad).map_err(failed)?;
                if let Some((_, topics)) = states.name().rsplit_once(": ").filter(|(_, topics)| topics.contains(", ")) {
                    self.tell.say(&format!("{}: joint states of {topics} are joined", bag.path.display()));
                }
                options.states = Some(states);
                source
            }
            Some(StatesSpec::File(file)) => {
                options.states = Some(JointStates::open_with(file, self.skip_bad)?);
                source
            }
        };
        options.max_age_s = self.joints_max_age_s.unwrap_or(options.max_age_s);
        let jointed = JointedSource::new(source, robot, body, options).map_err(|e| e.at(urdf.display()))?;
        let assumed = if known_up.is_none() { Z_IS_ASSUMED } else { "" };
        self.tell.say(&format!("{}: {}{assumed}", urdf.display(), jointed.summary()));
        Ok(Box::new(jointed))
    }
}

/// The frames of `source`, with the joint states of `topic`: by their stamps with the delay that is given, or where frames are
/// stamped by a robot, too.
#[cfg(feature = "ros2")]
fn live(
    source: Box<dyn Source + Send>,
    topic: &str,
    delay_s: Option<f64>,
    is_stamped: bool,
) -> Result<Box<dyn Source + Send>> {
    use crate::robot::{LiveJoints, StatesTime};
    let time = match delay_s {
        Some(delay_s) => StatesTime::Stamp { delay_s },
        None if is_stamped => StatesTime::Auto,
        None => StatesTime::Arrival,
    };
    Ok(Box::new(LiveJoints::open(source, topic, time)?))
}

#[cfg(not(feature = "ros2"))]
fn live(_: Box<dyn Source + Send>, topic: &str, _: Option<f64>, _: bool) -> Result<Box<dyn Source + Send>> {
    let what = "built without the feature `ros2`: cargo install --path . --features ros2";
    Err(Error::failed(what).at(format!("joint states `ros2:{topic}`")))
}
