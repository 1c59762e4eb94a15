//! How much later the joints' clock stamps an instant than the frames' clock: a number, or an estimate.

use std::fmt;
use std::str::FromStr;

use serde::de::Visitor;
use serde::{Deserialize, Deserializer};

use super::target::seconds;
use crate::error::{Error, Result};

/// How much later the clock of joint states stamps an instant than that of frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointsDelay {
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
        let delay = seconds(text).ok().filter(|seconds| seconds.is_finite());
        delay
            .map(Self::Seconds)
            .ok_or_else(|| Error::usage(format!("`{text}` is not a time; give seconds, a time such as 25ms, or auto")))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delay_is_seconds_or_auto() {
        assert_eq!("auto".parse(), Ok(JointsDelay::Auto));
        assert_eq!("-0.5".parse(), Ok(JointsDelay::Seconds(-0.5)));
        assert_eq!("-250ms".parse(), Ok(JointsDelay::Seconds(-0.25)));
        for text in ["", "inf", "nan", "1mm", "Auto"] {
            let error = text.parse::<JointsDelay>().unwrap_err().to_string();
            assert!(error.contains("give seconds, a time such as 25ms, or auto"), "{error}");
        }
    }
}
