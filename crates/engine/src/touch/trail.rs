//! Where a touch was, for its velocity.
//!
//! A position is kept where the last one kept is at least a 16th of the time over which velocity is measured old. Velocity is the
//! change from the newest position kept that is at least as old as that time, over the time since then: it lags by half of it.

use glam::DVec3;

/// Parts of the time from position to position.
const PARTS: f64 = 16.0;
/// What of a time may be missing for rounding, as a share.
const ROUNDING: f64 = 1e-6;
/// Most positions that are kept: those of the time, the one before, and one for rounding.
const MOST: usize = 19;

/// The positions of a touch in the past, of fixed size.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Trail {
    /// The oldest first.
    past: [Past; MOST],
    count: u32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Past {
    t_s: f64,
    position: DVec3,
}

impl Trail {
    /// Forgets all positions.
    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }

    /// Whether no position was kept since `over_s` before `t_s`.
    pub(crate) fn is_broken(&self, t_s: f64, over_s: f64) -> bool {
        let last = self.past[..self.count as usize].last();
        last.is_some_and(|last| t_s - last.t_s > over_s * (1.0 + ROUNDING))
    }

    /// When and where it was, the oldest first, s and m.
    pub(super) fn positions(&self) -> impl Iterator<Item = (f64, DVec3)> + '_ {
        self.past[..self.count as usize].iter().map(|past| (past.t_s, past.position))
    }

    /// Takes the `position` at `t_s`, m; the velocity over `over_s`, m/s, if the trail goes back so far.
    pub(crate) fn follow(&mut self, t_s: f64, position: DVec3, over_s: f64) -> Option<DVec3> {
        let past = &self.past[..self.count as usize];
        let is_old = |past: &Past, by_s: f64| t_s - past.t_s >= by_s * (1.0 - ROUNDING);
        let then = past.iter().rposition(|past| is_old(past, over_s));
        let velocity = then.map(|then| (position - past[then].position) / (t_s - past[then].t_s));
        if past.last().is_none_or(|last| t_s > last.t_s && is_old(last, over_s / PARTS)) {
            // Full only if times are odd.
            let older = then.unwrap_or(usize::from(past.len() == MOST));
            self.past.copy_within(older..self.count as usize, 0);
            self.count -= older as u32;
            self.past[self.count as usize] = Past { t_s, position };
            self.count += 1;
        }
        velocity.filter(|velocity| velocity.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocity_is_that_of_the_last_fifth_of_a_second_at_every_rate() {
        for rate_hz in [5.0, 30.0, 99.0, 100.0, 1000.0, 20_000.0] {
            let mut trail = Trail::default();
            let mut first = None;
            for frame in 0..(rate_hz as u32).max(40) {
                let t_s = 1.7e9 + f64::from(frame) / rate_hz;
                let since_s = t_s - 1.7e9;
                let velocity = trail.follow(t_s, DVec3::new(3.0, -2.0, 1.0) * since_s, 0.2);
                first = first.or(velocity.map(|_| since_s));
                if let Some(velocity) = velocity {
                    assert!(velocity.distance(DVec3::new(3.0, -2.0, 1.0)) < 1e-5, "{rate_hz}: {velocity}");
                }
            }
            let first = first.unwrap();
            assert!((0.2 - 1e-6..0.2 + 1.5 / rate_hz).contains(&first), "{rate_hz}: {first}");
        }
    }

    #[test]
    fn a_clock_that_stands_or_goes_back_gives_nothing_wrong() {
        let mut trail = Trail::default();
        for step in 0..100 {
            assert_eq!(trail.follow(1.0, DVec3::X * f64::from(step), 0.2), None);
        }
        for step in 0..100 {
            assert_eq!(trail.follow(0.9 - 0.1 * f64::from(step), DVec3::X, 0.2), None);
        }
        assert_eq!(trail.follow(1.3, DVec3::X * 0.3, 0.2), Some(DVec3::X * (0.3 / (1.3 - 1.0))));
        assert!(trail.is_broken(1.6, 0.2) && !trail.is_broken(1.5, 0.2));
        trail.clear();
        assert_eq!(trail.follow(9.0, DVec3::X, 0.2), None);
        assert!(!Trail::default().is_broken(9.0, 0.2), "there is nothing to break");
    }
}
