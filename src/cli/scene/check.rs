//! What does not go together in what is asked for.

use somatic::scene::MotionFilter;
use somatic::{Error, Outputs, Result};

use super::RunOptions;

impl RunOptions {
    pub(super) fn check(&self) -> Result<()> {
        self.check_accuracy().map_err(|(_, e)| e)?;
        self.line_flags().lines(&self.sources)?;
        if self.strict && self.sources != ["-"] {
            return Err(Error::usage(
                "--strict is for --source -; in other sources a taxel that the body does not have is always an error",
            ));
        }
        self.check_joints()?;
        let is_zenoh = |name: &String| name.starts_with("zenoh:") || name.starts_with("zenoh-percepts:");
        if self.zenoh_config.is_some() && !self.sources.iter().chain(&self.sinks).any(is_zenoh) {
            return Err(Error::usage("--zenoh-config is for limbs; add --source zenoh:KEY or --sink zenoh:KEY"));
        }
        if self.ros_time.is_some() && !self.sinks.iter().any(|sink| sink.starts_with("ros2")) {
            return Err(Error::usage(
                "--ros-time is for messages of ROS 2; add --sink ros2-mcap:FOLDER or --sink ros2",
            ));
        }
        if !self.allow_hosts.is_empty() && !self.sinks.iter().any(|sink| sink == "page" || sink.starts_with("page:")) {
            return Err(Error::usage("--allow-host is for a page; add --sink page:HOST:PORT"));
        }
        if let Some(speed) = self.speed.filter(|speed| !(speed.is_finite() && *speed > 0.0)) {
            return Err(Error::usage(format!(
                "--speed {speed} is not a speed; give a positive number, 1 for as recorded"
            )));
        }
        if let Some(age) = self.max_age.filter(|age| !(age.is_finite() && *age >= 0.0)) {
            return Err(Error::usage(format!("--max-age {age} is not a time span; give seconds from 0")));
        }
        if let Some(gap) = self.max_gap.filter(|gap| gap.is_nan() || *gap <= 0.0) {
            return Err(Error::usage(format!("--max-gap {gap} is not a time span; give seconds over 0")));
        }
        if let Some(touch) = self.touch {
            touch.check()?;
            if self.touches().is_none() {
                return Err(Error::usage("[touch] is for touches; add them to `outputs`"));
            }
        }
        if let Some(tolerance) = self.contact_tolerance {
            if !self.outputs().contains(Outputs::SELF_CONTACTS) {
                return Err(Error::usage("--contact-tolerance is for self_contacts; add them to --outputs"));
            }
            if !(tolerance.is_finite() && tolerance > 0.0) {
                return Err(Error::usage(format!(
                    "--contact-tolerance {tolerance} is no distance; give metres over 0"
                )));
            }
        }
        Ok(())
    }

    /// Which motion counts, if that is asked for.
    pub(super) fn filter(&self, outputs: Outputs) -> Result<MotionFilter> {
        let usual = MotionFilter::default();
        let given = [
            ("--filter-window", self.filter_window.is_some()),
            ("--filter-by", self.filter_by.is_some()),
            ("--filter-time", self.filter_time.is_some()),
            ("--filter-over", self.filter_over.is_some()),
        ];
        let is_measured = outputs.intersects(Outputs::FILTERED);
        if let Some((flag, _)) = given.iter().find(|(_, given)| *given && !is_measured) {
            return Err(Error::usage(format!(
                "{flag} is for outputs that are not asked for; add --outputs filtered_direction, or others of filtered_*"
            )));
        }
        let by_window = &given[1..3];
        if let Some((flag, _)) = by_window.iter().find(|(_, given)| *given && self.filter_over.is_some()) {
            return Err(Error::usage(format!("{flag} has no effect beside --filter-over; leave one of them out")));
        }
        let filter = usual
            .over_s(self.filter_over)
            .by(self.filter_by.unwrap_or(usual.by))
            .time_constant_s(self.filter_time.unwrap_or(usual.time_constant_s));
        self.filter_window.as_ref().map_or(Ok(filter), |window| filter.with_window(window))
    }
}
