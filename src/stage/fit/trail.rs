//! How a contact moves: where it is fitted now against where it was some time ago.
//!
//! A fit does not jump from sensor to sensor as a centroid does, so its difference over a time is the most accurate motion of all
//! that were tried (`docs/paper.md`). It lags behind by half of that time. Of a line only motion across it can be felt.
//!
//! The earlier place is the newest that is at least that old, of the same touch; frames whose touch has no fit are left out.
//! While there is none, or only one more than twice as old, motion is absent, `held`; in a touch's first frame it is absent,
//! `no_previous`, and where the clock goes back or stands, `bad_dt`.

use std::collections::VecDeque;

use glam::DVec2;

use crate::percept::{ContactKind, Fit, Flags};

/// How long ago the earlier place is, s, unless another time is asked for.
pub(crate) const OVER_S: f64 = 0.2;
/// How many times as old it may be, where fits are absent.
const LATEST: f64 = 2.0;
/// What of the time may be missing for rounding, as a share.
const ROUNDING: f64 = 1e-6;

/// Where a field's contact was.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Trail {
    /// The identity of its touch.
    touch: Option<u64>,
    /// Times, s, and places that may still be wanted, the oldest first.
    past: VecDeque<(f64, DVec2)>,
}

/// The motion of a contact over a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Moved {
    /// In the field's chart, m.
    pub(crate) displacement: DVec2,
    /// m/s.
    pub(crate) speed: f64,
}

impl Trail {
    /// Takes the next fit of a field, of the touch with identity `touch` at `t_s`.
    pub(crate) fn follow(&mut self, over_s: f64, t_s: f64, touch: u64, fit: &Fit) -> Result<Moved, Flags> {
        let place = DVec2::from_array(fit.place);
        let is_same = self.touch == Some(touch);
        // Not a number is not later either.
        let is_later = self.past.back().is_some_and(|last| t_s > last.0);
        if !(is_same && is_later) {
            self.touch = Some(touch);
            self.past.clear();
            self.past.push_back((t_s, place));
            return Err(if is_same { Flags::BAD_DT } else { Flags::NO_PREVIOUS });
        }
        self.past.push_back((t_s, place));
        let is_old = |past: &(f64, DVec2)| t_s - past.0 >= over_s * (1.0 - ROUNDING);
        while self.past.get(1).is_some_and(is_old) {
            self.past.pop_front();
        }
        let then = self.past.front().filter(|then| is_old(then) && t_s - then.0 <= LATEST * over_s);
        let &(then_s, then) = then.ok_or(Flags::HELD)?;
        let mut displacement = place - then;
        if let (ContactKind::Line, Some(angle)) = (fit.kind, fit.angle) {
            let across = DVec2::new(-libm::sin(angle), libm::cos(angle));
            displacement = across * displacement.dot(across);
        }
        Ok(Moved { displacement, speed: displacement.length() / (t_s - then_s) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(kind: ContactKind, place: [f64; 2]) -> Fit {
        let angle = (kind == ContactKind::Line).then_some(std::f64::consts::FRAC_PI_4);
        Fit { kind, place, force: None, angle, width: 1e-3, length: None, sigma: None }
    }

    #[test]
    fn motion_is_over_the_time_asked_for_and_of_one_touch() {
        let mut trail = Trail::default();
        let mut follow =
            |t_s: f64, touch: u64, u: f64| trail.follow(0.2, t_s, touch, &at(ContactKind::Point, [u, 0.0]));
        assert_eq!(follow(0.0, 1, 0.0), Err(Flags::NO_PREVIOUS));
        assert_eq!(follow(0.1, 1, 1e-3), Err(Flags::HELD));
        let moved = follow(0.2, 1, 3e-3).unwrap();
        assert_eq!((moved.displacement, moved.speed), (DVec2::new(3e-3, 0.0), 3e-3 / 0.2));
        // From the place at 0.1 s.
        assert!((follow(0.3, 1, 2e-3).unwrap().displacement.x - 1e-3).abs() < 1e-15);
        // A frame without a fit: the newest that is old enough is 0.3 s old.
        assert!((follow(0.6, 1, 6e-3).unwrap().speed - 4e-3 / 0.3).abs() < 1e-15);
        // Without fits for too long there is nothing to measure from.
        assert_eq!(follow(1.2, 1, 7e-3), Err(Flags::HELD));
        assert_eq!(follow(1.2, 1, 7e-3), Err(Flags::BAD_DT));
        assert_eq!(follow(1.3, 2, 7e-3), Err(Flags::NO_PREVIOUS));
    }

    #[test]
    fn a_line_moves_across_itself() {
        let mut trail = Trail::default();
        let mut follow = |t_s: f64, place| trail.follow(0.2, t_s, 1, &at(ContactKind::Line, place));
        follow(0.0, [0.0; 2]).unwrap_err();
        // 2 mm along and √2 mm across a line at 45°.
        let along = std::f64::consts::SQRT_2 * 1e-3;
        let moved = follow(0.2, [along - 1e-3, along + 1e-3]).unwrap();
        assert!((moved.displacement - DVec2::new(-1e-3, 1e-3)).length() < 1e-15, "{moved:?}");
    }
}
