//! What does not go together in what is asked for.

use super::SceneFile;
use crate::error::{Error, Result};
use crate::percept::{COLUMNS, Column, Outputs};
use crate::scene::receptor_of;
use crate::signal::Receptor;
use crate::sink::SinkSpec;
use crate::source::SourceSpec;

impl SceneFile {
    /// Whether all that it asks for goes together.
    ///
    /// # Errors
    /// A usage error that names a key in backticks, or with a value as a file has it: `` `max_gap_s = 0` is not a time span ``.
    pub fn check(&self) -> Result<()> {
        self.check_accuracy().map_err(|(_, e)| e)?;
        self.line_keys().lines(&self.sources)?;
        if self.strict && self.sources != [SourceSpec::Stdin] {
            return Err(Error::usage(
                "`strict` is for `source = \"-\"`; in other sources a taxel that the body does not have is always an error",
            ));
        }
        let has_messages = |source: &SourceSpec| {
            use SourceSpec::{Mcap, Modbus, Ndjson, Paxini, Ros2, Ros2Mcap, Stdin, Text};
            let is_live = matches!(source, Modbus(_) | Paxini { .. } | Ros2 { .. } | Stdin | Text(_));
            is_live || matches!(source, Mcap(_) | Ndjson(_) | Ros2Mcap(_))
        };
        let fits_none = self.sources.is_empty() || !self.sources.iter().all(has_messages);
        if self.map.is_some() && fits_none {
            return Err(Error::usage(
                "`map` is for ROS 2 bags and topics, NDJSON, lines of JSON, Modbus, or PaXini; add `source = \"ros2-mcap:BAG\"`, or leave it out",
            ));
        }
        let has_no_bad = |source: &SourceSpec| {
            use SourceSpec::{LeRobot, Mcap, Paxini, Ros2, Serial, Sim, Zenoh};
            let is_own = matches!(source, Mcap(_) | Ros2 { .. }) && self.map.is_none();
            is_own || matches!(source, LeRobot(_) | Paxini { .. } | Sim(_) | Serial { .. } | Zenoh(_))
        };
        if self.skip_bad && self.joint_states.is_none() && self.sources.iter().any(has_no_bad) {
            return Err(Error::usage("`skip_bad` is for CSV, NDJSON, exports and ROS 2 bags; leave it out here"));
        }
        self.check_several()?;
        self.check_joints()?;
        self.check_sinks()?;
        self.check_numbers()?;
        self.check_letters()?;
        if let Some(touch) = self.touch {
            touch.check()?;
            if self.touches().is_none() {
                return Err(Error::usage("[touch] is for touches; add them to `outputs`"));
            }
        }
        if self.contact_tolerance_m.is_some() && !self.outputs().contains(Outputs::SELF_CONTACTS) {
            return Err(Error::usage("`contact_tolerance_m` is for self_contacts; add them to `outputs`"));
        }
        self.filter().map(drop)
    }

    /// Whether it names an output for each letter that it names, if it names both: touches are made of letters, too.
    fn check_letters(&self) -> Result<()> {
        let outputs = self.outputs();
        if self.outputs.is_empty() || self.touches().is_some() || outputs.contains(Outputs::SELF_CONTACTS) {
            return Ok(());
        }
        let gives = |receptor: Receptor, column: &Column| match receptor_of(column) {
            of if of.is_of_pressure() => receptor.is_of_pressure(),
            of => of == receptor,
        };
        // An output of a letter that is not named is refused with its name.
        if !outputs.columns().all(|column| self.letters.iter().any(|&receptor| gives(receptor, column))) {
            return Ok(());
        }
        let is_idle = |receptor: &&Receptor| !outputs.columns().any(|column| gives(**receptor, column));
        let Some(&idle) = self.letters.iter().find(is_idle) else { return Ok(()) };
        let such_as = COLUMNS.iter().find(|column| gives(idle, column)).map_or("", |column| column.name);
        Err(Error::usage(format!(
            "`outputs` has none of letter `{idle}`; add one, such as `{such_as}`, or leave the letter out of `letters`"
        )))
    }

    /// Whether what it asks for is for several recordings, if it names several.
    fn check_several(&self) -> Result<()> {
        if self.sources.len() < 2 || !self.sources.iter().all(SourceSpec::is_recording) {
            return Ok(());
        }
        let of_one = [
            ("joint_states", self.joint_states.is_some()),
            ("poses", self.poses.is_some()),
            ("loop", self.repeat.is_some()),
        ];
        if let Some((key, _)) = of_one.iter().find(|(_, given)| *given) {
            return Err(Error::usage(format!("`{key}` is for one recording; leave it out, or run once for each")));
        }
        if let Some(sink) = self.sinks.iter().find(|sink| !sink.is_table()) {
            return Err(Error::usage(format!(
                "several recordings go into tables, which say of which one a row is, and not into `{sink}`; use `sink = \"csv:FILE\"` or \
                 `sink = \"parquet:FILE\"`"
            )));
        }
        let is_twice = |(index, source): &(usize, &SourceSpec)| self.sources[..*index].contains(source);
        match self.sources.iter().enumerate().find(is_twice) {
            Some((_, source)) => Err(Error::usage(format!("`{source}` is there twice; name each recording once"))),
            None => Ok(()),
        }
    }

    /// Whether accuracy, backend and outputs go together; if not, by which key.
    pub(super) fn check_accuracy(&self) -> Result<(), (&'static str, Error)> {
        self.accuracy.check(self.backend.unwrap_or_default(), self.outputs())
    }

    fn check_sinks(&self) -> Result<()> {
        let has_sink = |is_it: fn(&SinkSpec) -> bool| self.sinks.iter().any(is_it);
        let has_limbs = self.sources.iter().any(|source| matches!(source, SourceSpec::Zenoh(_)));
        if self.zenoh_config.is_some() && !has_limbs && !has_sink(|sink| matches!(sink, SinkSpec::Zenoh { .. })) {
            return Err(Error::usage(
                "`zenoh_config` is for limbs; add `source = \"zenoh:KEY\"` or `sink = \"zenoh:KEY\"`",
            ));
        }
        let is_ros = |sink: &SinkSpec| matches!(sink, SinkSpec::Ros2(_) | SinkSpec::Ros2Mcap(_));
        if self.ros_time.is_some() && !has_sink(is_ros) {
            return Err(Error::usage(
                "`ros_time` is for messages of ROS 2; add `sink = \"ros2-mcap:FOLDER\"` or `sink = \"ros2\"`",
            ));
        }
        if !self.record.is_empty() && !has_sink(|sink| matches!(sink, SinkSpec::Mcap(_))) {
            return Err(Error::usage("`record` is for a recording; add `sink = \"mcap:FILE\"`"));
        }
        if !self.allow_hosts.is_empty() && !has_sink(|sink| matches!(sink, SinkSpec::Page(_))) {
            return Err(Error::usage("`allow_host` is for a page; add `sink = \"page:HOST:PORT\"`"));
        }
        Ok(())
    }

    fn check_numbers(&self) -> Result<()> {
        if let Some(speed) = self.playback_speed.filter(|speed| !(speed.is_finite() && *speed > 0.0)) {
            return Err(Error::usage(format!(
                "`playback_speed = {speed}` is not a speed; give a positive number, 1 for as recorded"
            )));
        }
        if let Some(age) = self.max_age_s.filter(|age| !(age.is_finite() && *age >= 0.0)) {
            return Err(Error::usage(format!("`max_age_s = {age}` is not a time span; give seconds from 0")));
        }
        if let Some(gap) = self.max_gap_s.filter(|gap| gap.is_nan() || *gap <= 0.0) {
            return Err(Error::usage(format!("`max_gap_s = {gap}` is not a time span; give seconds over 0")));
        }
        if let Some(tolerance) = self.contact_tolerance_m.filter(|it| !(it.is_finite() && *it > 0.0)) {
            return Err(Error::usage(format!(
                "`contact_tolerance_m = {tolerance}` is not a distance; give metres over 0"
            )));
        }
        Ok(())
    }
}
