//! **difference**: filtered motion over a time: the centroid now against where it was that long ago.
//!
//! The alternative to [`super::filter`]'s window. A single step between frames says little where few sensors feel a touch: its
//! centroid stays with one sensor and then jumps towards the next. Over some tenths of a second the jumps average out; what is given
//! is the mean of that time, and lags behind by half of it.
//!
//! From the newest centroid that is at least as old as that time, of the same contact, come displacement, direction and speed. While
//! a contact is younger there are none, `held`. A step from one frame to the next beyond the window's high end is another touch,
//! `jumped`; it starts anew there. A frame at the very time of the one before adds nothing, `bad_dt`; where a clock goes back, or
//! too far on, it starts anew, `bad_dt` too. A displacement that rounding may feign has no direction, `still`. (A Kalman filter
//! with constant velocity is no better at the same lag: `docs/evidence/paper.md` has the figures.)
//!
//! This stage is the host's, in f64, on every backend, from the backend's own centroid.
//!
//! **Bound.** With b the sum of both centroids' bounds, a displacement is off by b and the rounding of f64 here, its direction by
//! asin(b/‖Δ‖), its speed by b/Δt.

use std::collections::VecDeque;

use super::filter::{Clock, FilterBound, Filtered, Settings};
use super::limit::Limit;
use super::motion::Centroid;
use super::{SLACK, U};
use crate::percept::{Flags, Outputs};

/// What of the time may be missing for rounding in the sum of steps, as a share.
const ROUNDING: f64 = 1e-6;

/// Where a contact's centroid was.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Past {
    /// s since this began.
    t_s: f64,
    centroid: Centroid,
}

/// What is kept of a field from frame to frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Memory {
    /// The centroids that may still be wanted, the oldest first.
    past: VecDeque<Past>,
}

/// What a frame's centroid meets.
enum Step {
    Begins(Flags),
    Stands,
    /// It goes on from the frame before.
    Goes(Past),
}

impl Memory {
    /// Forgets the contact that has ended.
    pub(crate) fn release(&mut self) {
        self.past.clear();
    }

    fn step(&self, settings: &Settings, clock: Clock, centroid: Centroid) -> Step {
        let Some(last) = self.past.back() else { return Step::Begins(Flags::NO_PREVIOUS) };
        match clock {
            Clock::Broken => Step::Begins(Flags::BAD_DT),
            Clock::Stands => Step::Stands,
            Clock::Runs(_) if (centroid.place - last.centroid.place).length() > settings.window_m[1] => {
                Step::Begins(Flags::JUMPED)
            }
            Clock::Runs(dt_s) => Step::Goes(Past { t_s: last.t_s + dt_s, centroid }),
        }
    }

    /// Takes the next centroid of a contact, m, over `over_s`.
    pub(crate) fn follow(&mut self, settings: &Settings, over_s: f64, clock: Clock, centroid: Centroid) -> Filtered {
        let mut filtered = Filtered::default();
        match self.step(settings, clock, centroid) {
            Step::Stands => filtered.flags |= Flags::BAD_DT,
            Step::Begins(why) => {
                self.past.clear();
                self.past.push_back(Past { t_s: 0.0, centroid });
                filtered.flags |= why;
            }
            Step::Goes(now) => {
                self.past.push_back(now);
                let is_old = |past: &Past| now.t_s - past.t_s >= over_s * (1.0 - ROUNDING);
                while self.past.get(1).is_some_and(is_old) {
                    self.past.pop_front();
                }
                match self.past.front().filter(|past| is_old(past)) {
                    Some(then) => self.over(settings, *then, now, &mut filtered),
                    None => filtered.flags |= Flags::HELD,
                }
            }
        }
        filtered
    }

    fn over(&self, settings: &Settings, then: Past, now: Past, filtered: &mut Filtered) {
        filtered.displacement = now.centroid.place - then.centroid.place;
        filtered.speed = filtered.displacement.length() / (now.t_s - then.t_s);
        filtered.present |= Outputs::FILTERED_DISPLACEMENT | Outputs::FILTERED_SPEED;
        if filtered.displacement.length() > settings.still_within(then.centroid, now.centroid) {
            // A zero below the axis would put π at −π.
            filtered.direction = libm::atan2(filtered.displacement.y + 0.0, filtered.displacement.x + 0.0);
            filtered.present |= Outputs::FILTERED_DIRECTION;
        } else {
            filtered.flags |= Flags::STILL;
        }
    }
}

/// What the bound of a field's next frame depends on.
#[derive(Clone, Debug, Default)]
pub(crate) struct Doubt {
    right: Memory,
    /// How far each of the remembered centroids may be off, m.
    off: VecDeque<f64>,
}

impl Doubt {
    /// After a frame that left `memory` for certain.
    pub(crate) fn after(memory: &Memory) -> Self {
        Self { right: memory.clone(), off: VecDeque::from(vec![0.0; memory.past.len()]) }
    }

    /// Forgets the contact that has ended.
    pub(crate) fn release(&mut self) {
        *self = Self::default();
    }

    /// The bounds of the next frame of a contact, whose centroid is off by up to `off` (m).
    pub(crate) fn follow(
        &mut self,
        settings: &Settings,
        over_s: f64,
        clock: Clock,
        centroid: Centroid,
        off: f64,
    ) -> FilterBound {
        let apart = |from: Centroid, off: f64, more: f64| {
            // Beside f32's error, a few roundings of f64 on both sides.
            SLACK * (off + more + U * U * (centroid.place.length() + from.place.length()))
        };
        if let (Some(last), Clock::Runs(_)) = (self.right.past.back(), clock) {
            let step = (centroid.place - last.centroid.place).length();
            let moved = apart(last.centroid, off, self.off.back().copied().unwrap_or_default());
            if (step - settings.window_m[1]).abs() <= moved {
                let (in_doubt, near) = (Flags::HELD | Flags::JUMPED | Flags::STILL, Limit::TooClose);
                self.right.follow(settings, over_s, clock, centroid);
                return FilterBound { in_doubt, displacement: near, direction: near, speed: near, may_remember: true };
            }
        }
        let stands = clock == Clock::Stands && !self.right.past.is_empty();
        let filtered = self.right.follow(settings, over_s, clock, centroid);
        let mut bound = FilterBound::default();
        if stands {
            return bound;
        }
        self.off.push_back(off);
        while self.off.len() > self.right.past.len() {
            self.off.pop_front();
        }
        let Some(then) = self.right.past.front().filter(|_| filtered.present.contains(Outputs::FILTERED_SPEED)) else {
            return bound;
        };
        let moved = apart(then.centroid, off, self.off[0]);
        let length = filtered.displacement.length();
        bound.displacement = Limit::Within(moved);
        if filtered.speed > 0.0 {
            let dt_s = length / filtered.speed;
            bound.speed = Limit::Within((moved + U * U * length) / dt_s);
        } else {
            bound.speed = Limit::Within(moved / over_s);
        }
        let has_direction = filtered.present.contains(Outputs::FILTERED_DIRECTION);
        let near = (length - settings.still_within(then.centroid, centroid)).abs() <= moved;
        let turned = (moved < length).then(|| (moved / length).asin() + U * U);
        bound.direction = Limit::from_bound(turned, has_direction, near);
        if near {
            bound.in_doubt |= Flags::STILL;
        }
        bound
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use glam::DVec2;

    use super::*;
    use crate::stage::filter::FilterBy;
    use crate::stage::layout::Still;

    fn settings() -> Settings {
        let still = Still { least: 1e-9, ..Still::default() };
        Settings {
            window_m: [0.0, 0.02],
            by: FilterBy::Distance,
            time_constant_s: 0.0,
            over_s: Some(0.2),
            still,
            unit_m: 1.0,
        }
    }

    fn at(u: f64, v: f64) -> Centroid {
        Centroid { place: DVec2::new(u, v), pressed: 1 }
    }

    #[test]
    fn it_is_the_mean_over_that_time() {
        let mut memory = Memory::default();
        let mut push = |clock, u, v| memory.follow(&settings(), 0.2, clock, at(u, v));
        assert_eq!(push(Clock::Runs(0.02), 0.0, 0.0).flags, Flags::NO_PREVIOUS);
        for frame in 1..10 {
            let held = push(Clock::Runs(0.02), 1e-3 * f64::from(frame), 0.0);
            assert_eq!((held.flags, held.present), (Flags::HELD, Outputs::empty()), "{frame}");
        }
        let full = push(Clock::Runs(0.02), 0.010, 0.0);
        assert!((full.speed - 0.05).abs() < 1e-12 && full.direction == 0.0 && full.flags.is_empty());
        // Turning round at once: half of the time forth, half of it back, are not motion.
        for frame in 0..9 {
            push(Clock::Runs(0.02), 0.009 - 1e-3 * f64::from(frame), 0.0);
        }
        let back = push(Clock::Runs(0.02), 0.0, 0.0);
        assert!((back.speed - 0.05).abs() < 1e-12 && (back.direction - PI).abs() < 1e-12);
        assert_eq!(push(Clock::Stands, 0.5, 0.0).flags, Flags::BAD_DT);
        assert_eq!(push(Clock::Runs(0.02), 0.5, 0.0).flags, Flags::JUMPED);
        assert_eq!(push(Clock::Runs(0.02), 0.5, 0.0).flags, Flags::HELD);
        // A dropped frame counts its time.
        let late = push(Clock::Runs(0.48), 0.51, 0.0);
        assert!((late.speed - 0.01 / 0.48).abs() < 1e-12, "{}", late.speed);
        assert_eq!(push(Clock::Broken, 0.51, 0.0).flags, Flags::BAD_DT);
        assert_eq!(push(Clock::Runs(0.2), 0.51, 0.0).flags, Flags::STILL);
    }

    #[test]
    fn memory_does_not_grow() {
        let mut memory = Memory::default();
        for frame in 0..10_000 {
            memory.follow(&settings(), 0.2, Clock::Runs(0.02), at(1e-3 * f64::from(frame % 7), 0.0));
            assert!(memory.past.len() <= 12);
        }
    }

    /// Two of them over the same path, one fed places that are off by up to `off`, held to the bounds.
    fn within_bounds(off: f64, claimed: f64) -> Result<[u32; 2], String> {
        let mut seed = 1_u32;
        let mut random = move || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed >> 8) / f64::from(1 << 23) - 1.0
        };
        let settings = Settings { window_m: [0.0, 2.4e-3], ..settings() };
        let (mut right, mut other, mut doubt) = (Memory::default(), Memory::default(), Doubt::default());
        let mut place = DVec2::ZERO;
        let [mut compared, mut doubted] = [0, 0];
        for _ in 0..6000 {
            place = (place + 2e-3 * DVec2::new(random(), random())).clamp(DVec2::splat(-0.05), DVec2::splat(0.05));
            let clock = match random() {
                x if x > 0.99 => Clock::Broken,
                x if x > 0.95 => Clock::Stands,
                x => Clock::Runs(0.04 + 0.02 * x),
            };
            let turn = PI * random();
            let near = place + off * DVec2::new(turn.cos(), turn.sin());
            if random() > 0.99 {
                (right, other, doubt) = Default::default();
            }
            let a = right.follow(&settings, 0.1, clock, at(place.x, place.y));
            let b = other.follow(&settings, 0.1, clock, at(near.x, near.y));
            let bound = doubt.follow(&settings, 0.1, clock, at(place.x, place.y), claimed);
            if !((a.flags ^ b.flags) - bound.in_doubt).is_empty() {
                return Err(format!("{:?} {:?}", a.flags, b.flags));
            }
            doubted += u32::from(!bound.in_doubt.is_empty());
            if bound.may_remember {
                (right, doubt) = (other.clone(), Doubt::after(&other));
            }
            let turned = super::super::angle::between_directions(a.direction, b.direction);
            for (error, limit, output) in [
                ((a.displacement - b.displacement).length(), bound.displacement, Outputs::FILTERED_DISPLACEMENT),
                (turned, bound.direction, Outputs::FILTERED_DIRECTION),
                ((a.speed - b.speed).abs(), bound.speed, Outputs::FILTERED_SPEED),
            ] {
                let Limit::Within(limit) = limit else { continue };
                if (a.present ^ b.present).contains(output) || error > limit {
                    return Err(format!("{error} over {limit}"));
                }
                compared += u32::from(a.present.contains(output));
            }
        }
        Ok([compared, doubted])
    }

    #[test]
    fn centroids_that_are_off_stay_within_the_bounds() {
        for off in [1e-9, 1e-6, 1e-5] {
            let [compared, doubted] = within_bounds(off, off).unwrap();
            assert!(compared > 1000, "{off}: {compared} compared, {doubted} in doubt");
            assert!(off < 1e-7 || doubted > 0);
        }
        // Negative control: a bound that claims a third of the error does not hold.
        assert!(within_bounds(1e-5, 3e-6).is_err());
    }
}
