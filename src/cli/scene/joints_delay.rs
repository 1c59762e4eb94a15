//! How much later the joints' clock stamps an instant than the frames' clock: a number, or an estimate.

use std::fmt;
use std::str::FromStr;

use serde::de::Visitor;
use serde::{Deserialize, Deserializer};
use somatic::robot::DelayEstimate;
use somatic::source::SourceSpec;
use somatic::{Error, Result};

use super::RunOptions;
use crate::cli::states_topic::StatesFrom;
use crate::cli::stdio::say;

/// What is said of the two clocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::cli) enum JointsDelay {
    /// It is estimated.
    Auto,
    /// It is known, s.
    Seconds(f64),
}

impl FromStr for JointsDelay {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        let seconds = text.parse().ok().filter(|seconds: &f64| seconds.is_finite());
        seconds
            .map(Self::Seconds)
            .ok_or_else(|| Error::usage(format!("`{text}` is not a time span; give seconds, or auto")))
    }
}

impl<'de> Deserialize<'de> for JointsDelay {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Delay;

        impl Visitor<'_> for Delay {
            type Value = JointsDelay;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("seconds, or \"auto\"")
            }

            fn visit_i64<E: serde::de::Error>(self, seconds: i64) -> Result<JointsDelay, E> {
                Ok(JointsDelay::Seconds(seconds as f64))
            }

            fn visit_f64<E: serde::de::Error>(self, seconds: f64) -> Result<JointsDelay, E> {
                seconds.to_string().parse().map_err(E::custom)
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<JointsDelay, E> {
                match text {
                    "auto" => Ok(JointsDelay::Auto),
                    _ => Err(E::custom(format!("`{text}` is not a time span; give seconds, or \"auto\""))),
                }
            }
        }

        from.deserialize_any(Delay)
    }
}

impl RunOptions {
    /// Whether what is asked for can be had, where the joints come from `states`.
    pub(super) fn check_delay(&self, states: Option<&StatesFrom<'_>>) -> Result<()> {
        let refuse = |what: &str| Err(Error::usage(what));
        match (self.joints_delay, states) {
            (None, _) | (Some(JointsDelay::Seconds(_)), Some(StatesFrom::File(_) | StatesFrom::Bag(_))) => Ok(()),
            (Some(JointsDelay::Auto), Some(StatesFrom::Topic(_))) => refuse(
                "--joints-delay auto is not for live topics, whose states have the frame's own time; leave it out",
            ),
            (Some(_), None | Some(StatesFrom::Topic(_))) => refuse(
                "--joints-delay is for a recording of joint states; states in frames and of topics have the frame's own time",
            ),
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
    pub(super) fn delay_s(&self, states: Option<&StatesFrom<'_>>) -> Result<f64> {
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delay_is_seconds_or_auto() {
        assert_eq!("auto".parse(), Ok(JointsDelay::Auto));
        assert_eq!("-0.5".parse(), Ok(JointsDelay::Seconds(-0.5)));
        for text in ["", "inf", "nan", "1s", "Auto"] {
            assert!(text.parse::<JointsDelay>().unwrap_err().to_string().contains("give seconds, or auto"), "{text}");
        }
    }
}
