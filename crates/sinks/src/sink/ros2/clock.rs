//! Which times messages of ROS have.

use std::time::{SystemTime, UNIX_EPOCH};

use crate::signal::FrameTime;
use crate::sink::RosTime;

/// Gives each frame a time that does not fall.
pub(super) struct RosClock {
    which: RosTime,
    /// What is added to a frame's time, ns.
    shift_ns: Option<u64>,
    last_ns: u64,
}

impl RosClock {
    pub(super) fn new(which: RosTime) -> Self {
        Self { which, shift_ns: None, last_ns: 0 }
    }

    /// The time of a frame at `time`, ns; the last frame's where the source's time goes back.
    pub(super) fn time_ns(&mut self, time: impl Into<FrameTime>) -> u64 {
        let own_ns = u64::try_from(time.into().ns()).unwrap_or(0);
        let shift_ns = *self.shift_ns.get_or_insert_with(|| match self.which {
            RosTime::Recording => 0,
            RosTime::Wall => {
                let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
                u64::try_from(now.as_nanos()).unwrap_or(u64::MAX).saturating_sub(own_ns)
            }
        });
        self.last_ns = self.last_ns.max(own_ns.saturating_add(shift_ns));
        self.last_ns
    }

    /// The time of the last frame, ns.
    pub(super) fn last_ns(&self) -> u64 {
        self.last_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_the_recordings_or_go_on_from_now() {
        let mut clock = RosClock::new(RosTime::Recording);
        assert_eq!(
            [0.5, 1.0, 0.25, 2.0].map(|t_s| clock.time_ns(t_s)),
            [500_000_000, 1_000_000_000, 1_000_000_000, 2_000_000_000]
        );
        let before = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos() as u64;
        let mut clock = RosClock::new(RosTime::Wall);
        let first = clock.time_ns(7.0);
        assert!((before..before + 60_000_000_000).contains(&first));
        assert_eq!(clock.time_ns(7.5) - first, 500_000_000);
        assert_eq!(clock.last_ns(), first + 500_000_000);
    }
}
