//! Joints that move the body's links.

use somatic::body::Up;
use somatic::robot::{DelayEstimate, JointOptions, JointedSource, Kinematics};
use somatic::source::{BagName, JointStates, Source, SourceSpec};
use somatic::{Body, Error, Result};

use super::RunOptions;
use super::joints_delay::JointsDelay;
use crate::cli::states_from::StatesFrom;
use crate::cli::stdio::say;

/// What is added where nothing says which axis points up in the URDF.
const Z_IS_ASSUMED: &str = "; its z is taken as up, as REP 103 has it: where its y is up, give --up y";

impl RunOptions {
    pub(super) fn check_joints(&self) -> Result<()> {
        let refuse = |what: &str| Err(Error::usage(what));
        let given = [
            ("--joint-states", self.joint_states.is_some()),
            ("--up", self.up.is_some()),
            ("--joints-delay", self.joints_delay.is_some()),
            ("--joints-max-age", self.joints_max_age.is_some()),
        ];
        if self.joints.is_none() {
            return match given.into_iter().find(|(_, given)| *given) {
                Some((flag, _)) => {
                    Err(Error::usage(format!("{flag} is for a robot's joints; add --joints robot.urdf")))
                }
                None => Ok(()),
            };
        }
        let states = self.states_from()?;
        if states.is_none() && self.sources != ["-"] && !self.sources.iter().any(|s| is_mcap(s)) {
            return refuse(
                "frames of this source carry no joint states; give a recording of them: --joint-states FILE, a CSV under \
                 t,<joint>,..., NDJSON or a bag of ROS 2",
            );
        }
        if states.is_some() && self.repeat.is_some() {
            return refuse(
                "--loop lets the time of frames go on, and the recording of joint states ends; leave --loop out",
            );
        }
        self.check_delay(states.as_ref())?;
        if let Some(age) = self.joints_max_age.filter(|age| age.is_nan() || *age < 0.0) {
            return Err(Error::usage(format!("--joints-max-age {age} is not a time span; give seconds from 0")));
        }
        Ok(())
    }

    /// Whether what is asked for can be had, where the joints come from `states`.
    fn check_delay(&self, states: Option<&StatesFrom<'_>>) -> Result<()> {
        let refuse = |what: &str| Err(Error::usage(what));
        match (self.joints_delay, states) {
            (None, _) | (Some(JointsDelay::Seconds(_)), Some(_)) => Ok(()),
            (Some(JointsDelay::Auto), Some(StatesFrom::Topic(_))) => refuse(
                "--joints-delay auto is not for live topics; estimate it once from a bag of both, and give it in seconds",
            ),
            (Some(_), None) => {
                refuse("--joints-delay is for --joint-states; states in frames have the frame's own time")
            }
            (Some(JointsDelay::Auto), Some(StatesFrom::File(_))) => refuse(
                "--joints-delay auto compares stamps with arrivals, and this file of --joint-states has no arrivals; give both \
                 from one bag, --joint-states BAG and --source ros2-mcap:BAG, or the delay in seconds",
            ),
            (Some(JointsDelay::Auto), Some(StatesFrom::Bag(_))) => match self.first_source()? {
                Some(SourceSpec::Ros2Mcap(_)) => Ok(()),
                _ => refuse(
                    "--joints-delay auto compares stamps with arrivals, and frames of this source have no arrivals; give both \
                     from one bag, --source ros2-mcap:BAG and --joint-states BAG, or the delay in seconds",
                ),
            },
        }
    }

    /// The delay to go by, s, where the joints come from `states`; an estimate is said.
    fn delay_s(&self, states: Option<&StatesFrom<'_>>) -> Result<f64> {
        match self.joints_delay {
            None => Ok(0.0),
            Some(JointsDelay::Seconds(seconds)) => Ok(seconds),
            Some(JointsDelay::Auto) => {
                let (Some(StatesFrom::Bag(joints)), Some(SourceSpec::Ros2Mcap(frames))) =
                    (states, self.first_source()?)
                else {
                    return Err(Error::usage("--joints-delay auto is for frames and joint states from one bag"));
                };
                let estimate = DelayEstimate::of_bags(&frames, joints)?;
                if !self.quiet {
                    say(&format!("{}: {estimate}", joints.path.display()));
                }
                Ok(estimate.delay_s())
            }
        }
    }

    fn states_from(&self) -> Result<Option<StatesFrom<'_>>> {
        if let Some(states) = &self.joint_states {
            return StatesFrom::named(states).map(Some);
        }
        // Frames of a bag carry no joints, and the bag has them beside.
        Ok(match self.first_source()? {
            Some(SourceSpec::Ros2Mcap(bag)) => Some(StatesFrom::Bag(BagName::new(bag.path))),
            _ => None,
        })
    }

    /// `source`, with poses of the links of `body` where joints are asked for.
    pub(in crate::cli) fn jointed(
        &self,
        source: Box<dyn Source + Send>,
        body: &Body,
    ) -> Result<Box<dyn Source + Send>> {
        let Some(urdf) = &self.joints else { return Ok(source) };
        let known_up = self.up.or_else(|| body.urdf_up());
        let robot = Kinematics::load(urdf)?;
        let mut options = JointOptions::new(known_up.unwrap_or(Up::Z));
        let states = self.states_from()?;
        options.delay_s = self.delay_s(states.as_ref())?;
        let source = match states {
            None => source,
            Some(StatesFrom::Topic(topic)) => {
                let is_stamped = matches!(self.first_source()?, Some(SourceSpec::Ros2 { .. }));
                live(source, topic, self.joints_delay.is_some().then_some(options.delay_s), is_stamped)?
            }
            Some(StatesFrom::Bag(bag)) => {
                let failed = |e: Error| match self.joint_states {
                    Some(_) => e,
                    None => Error::failed(format!("{e}; or give joint states of another file: --joint-states FILE")),
                };
                options.states = Some(somatic::robot::joint_states_of_bag(&bag).map_err(failed)?);
                source
            }
            Some(StatesFrom::File(file)) => {
                options.states = Some(JointStates::open(file)?);
                source
            }
        };
        options.max_age_s = self.joints_max_age.unwrap_or(options.max_age_s);
        let jointed = JointedSource::new(source, robot, body, options).map_err(|e| e.at(urdf.display()))?;
        if !self.quiet {
            let assumed = if known_up.is_none() { Z_IS_ASSUMED } else { "" };
            say(&format!("{}: {}{assumed}", urdf.display(), jointed.summary()));
        }
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
    use somatic::robot::{LiveJoints, StatesTime};
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

fn is_mcap(source: &str) -> bool {
    matches!(source.parse(), Ok(SourceSpec::Mcap(_)))
}
