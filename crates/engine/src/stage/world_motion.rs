//! World motion: how fast a touch moves in the world, over the skin and with the link together.
//!
//! ‖x − x′‖/Δt, x and x′ being the centroid's position on the skin in the world (or in the link that the scene names) in this frame
//! and the one before. Motion over the skin alone is [`super::motion`]'s. Absent at the onset of a contact, and in the frame after
//! one without a pose (`no_previous`), where this frame has no pose (`no_pose`), and where the clock does not run (`bad_dt`).
//!
//! This stage is the host's, in f64, on every backend, from the backend's own centroid.
//!
//! **Bound.** With b the sum of both positions' bounds, which includes the rounding of poses, it is off by b/Δt.

use glam::DVec3;

use super::limit::Limit;
use super::{POSE_ROUNDING, SLACK, U};
use crate::percept::Flags;

/// What is kept of a field from frame to frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Memory {
    /// Where it was touched in the frame before, m.
    position_in_world: Option<DVec3>,
}

impl Memory {
    /// Forgets the contact that has ended.
    pub(crate) fn release(&mut self) {
        self.position_in_world = None;
    }

    /// Takes the next position of a contact, m, a time `dt_s` after the one before, unless `broken` says what is wrong with that.
    /// Gives the speed, m/s, or why there is none.
    pub(crate) fn follow(&mut self, dt_s: f64, broken: Flags, position_in_world: Option<DVec3>) -> Result<f64, Flags> {
        let before = std::mem::replace(&mut self.position_in_world, position_in_world);
        match (position_in_world, before) {
            (None, _) => Err(Flags::NO_POSE),
            (_, None) => Err(Flags::NO_PREVIOUS),
            _ if !broken.is_empty() => Err(broken),
            (Some(now), Some(before)) => Ok((now - before).length() / dt_s),
        }
    }

    /// How far the speed may be off that comes of `self` and then `next`, m/s; `off` says how far their positions may be, m.
    pub(crate) fn bound(self, dt_s: f64, next: Self, off: [f64; 2]) -> Limit {
        let [Some(before), Some(now)] = [self, next].map(|memory| memory.position_in_world) else {
            return Limit::default();
        };
        let moved = (now - before).length();
        let rounding = POSE_ROUNDING * (now.length() + before.length()) + U * U * moved;
        Limit::Within(SLACK * (off[0] + off[1] + rounding) / dt_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_speed_is_the_step_between_two_frames_over_its_time() {
        let mut memory = Memory::default();
        let mut follow = |dt_s, broken, x: Option<f64>| memory.follow(dt_s, broken, x.map(|x| DVec3::new(x, 1.0, 0.0)));
        assert_eq!(follow(0.5, Flags::empty(), Some(1.0)), Err(Flags::NO_PREVIOUS));
        assert_eq!(follow(0.5, Flags::empty(), Some(2.0)), Ok(2.0));
        assert_eq!(follow(0.0, Flags::BAD_DT, Some(3.0)), Err(Flags::BAD_DT));
        assert_eq!(follow(0.25, Flags::empty(), Some(2.5)), Ok(2.0), "from where it was in that frame");
        assert_eq!(follow(0.25, Flags::empty(), None), Err(Flags::NO_POSE));
        assert_eq!(follow(0.25, Flags::empty(), Some(9.0)), Err(Flags::NO_PREVIOUS));
        memory.release();
        assert_eq!(memory, Memory::default());
    }

    #[test]
    fn positions_that_are_off_by_a_little_stay_within_the_bound() {
        let mut worst: f64 = 0.0;
        for step in 1..200 {
            let way = DVec3::new(f64::from(step).sin(), f64::from(step).cos(), 0.3).normalize();
            let (before, now) = (DVec3::new(1e3, 2.0, f64::from(step)), DVec3::new(1e3, 2.001, f64::from(step)));
            let right = (now - before).length() / 0.01;
            let got = (now + 1e-6 * way - (before - 2e-6 * way)).length() / 0.01;
            let memory = |position| Memory { position_in_world: Some(position) };
            let Limit::Within(bound) = memory(before).bound(0.01, memory(now), [2e-6, 1e-6]) else {
                panic!("no bound")
            };
            worst = worst.max((got - right).abs() / bound);
        }
        // Both are off by all they may be, but not always along the way.
        assert!(worst > 0.5 && worst <= 1.0, "{worst}");
    }
}
