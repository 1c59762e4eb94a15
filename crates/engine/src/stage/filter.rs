//! **filter**: motion that counts, in space and in time; the window of eq. 7 and the "filtered direction" of Fig. 7.
//!
//! **In space.** A centroid counts when it has come far enough from the last one that counted, and not too far: when the
//! measure of the step between the two lies in the window [low, high]. The measure is the step's length, or the paper's
//! |ΔR| = |‖c‖ − ‖c′‖| (eq. 6–7), which is blind to motion around the chart's origin. A step short of the window is `held`
//! back until it has added up, so that slow motion passes in the end while jitter does not. One beyond it is another
//! touch rather than motion, `jumped`: filtering starts anew where it ends. What rounding may feign ([`super::motion`])
//! never counts. The first centroid of a contact has `no_previous`.
//!
//! A step that counts has a displacement, from the last centroid that counted, and a speed: its length over the time
//! since then. Frames that were dropped or held back so count with their time.
//!
//! **In time.** Each such step turns the filtered direction towards its own by the share 1 − exp(−Δt/τ), Δt being that
//! same time; the first stands for itself, as all do with τ = 0. Unit vectors are averaged, not angles, so that nothing
//! happens at the seam of ±π. Between steps that count the direction stays what it was. An average shorter than
//! [`LEAST_HEADING`] is of steps that cancel out: no direction, `still`.
//!
//! **Clocks.** A frame at the very time of the one before adds nothing: it never counts, flagged `bad_dt`, and what was
//! known stays. A clock that goes back, or by more than the scene's longest gap, says no longer how long anything took:
//! filtering starts anew there, flagged `bad_dt` too. Time is summed from the steps between frames that can be used, so
//! that no jump of the clock is ever in it.
//!
//! This stage is the host's, in f64, on every backend, from the backend's own centroid.
//!
//! **Bound.** With b the sum of both centroids' bounds, a step is off by δ = b and the rounding of f64 here, and so is
//! either measure (each is 1-Lipschitz in both places). The choice is certain where the measure keeps δ from the ends of
//! the window. A unit vector is off by asin(δ/‖Δ‖) at most, an average by e ← (1 − share)·e + share·asin(δ/‖Δ‖), its
//! direction by asin(e/‖h‖), a speed by δ/Δt. After a choice in doubt the comparison goes on from what the backend's own
//! filter remembers.

use glam::DVec2;

use super::layout::Still;
use super::limit::Limit;
use super::motion::{Centroid, SHORTEST_STEP_S};
use super::{GivenLimit, SLACK, U, scalar};
use crate::percept::{Flags, Host, Outputs};

/// The length under which an average of unit vectors has no direction, as steps cancel out.
pub(crate) const LEAST_HEADING: f64 = 1e-3;

/// What the window of the filter of motion measures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FilterBy {
    /// How far the centroid has come.
    #[default]
    Distance,
    /// The paper's ΔR (eq. 7), without its sign: how far it has come from or towards the chart's origin.
    Radial,
}

/// The filter of one field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Settings {
    /// Ends of the window, m.
    pub(crate) window_m: [f64; 2],
    pub(crate) by: FilterBy,
    /// τ, s.
    pub(crate) time_constant_s: f64,
    /// Measure over this time instead, s, as [`super::difference`] does.
    pub(crate) over_s: Option<f64>,
    /// The step up to which the centroid counts as still, in the field's unit.
    pub(crate) still: Still,
    pub(crate) unit_m: f64,
}

/// What becomes of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Choice {
    Held,
    Counts,
    Jumped,
}

impl Settings {
    /// The step between two centroids, m, that rounding may feign.
    pub(crate) fn still_within(&self, from: Centroid, to: Centroid) -> f64 {
        self.still.within(from.pressed + to.pressed) * self.unit_m
    }

    /// What becomes of a step, and whether one that is off by `bound` (m) might fare otherwise.
    fn judge(&self, from: Centroid, to: Centroid, bound: f64) -> (Choice, bool) {
        let [low, high] = self.window_m;
        let still_within = self.still_within(from, to);
        let length = (to.place - from.place).length();
        let measure = match self.by {
            FilterBy::Distance => length,
            FilterBy::Radial => (to.place.length() - from.place.length()).abs(),
        };
        let near = |value: f64, end: f64| (value - end).abs() <= bound;
        let choice = match measure {
            _ if length <= still_within => Choice::Held,
            beyond if beyond > high => Choice::Jumped,
            short if short < low => Choice::Held,
            _ => Choice::Counts,
        };
        let moved = length > still_within;
        let at_an_end = moved && ((low > 0.0 && near(measure, low)) || near(measure, high));
        (choice, at_an_end || near(length, still_within))
    }
}

/// The time since the frame before, as far as this stage goes by it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Clock {
    /// s.
    Runs(f64),
    /// The frame has the time of the one before.
    Stands,
    /// Nobody knows how long it was.
    Broken,
}

impl Clock {
    /// Of a step of `dt_s`, with `flags` where it cannot be used.
    pub(crate) fn new(dt_s: f64, flags: Flags) -> Self {
        if flags.is_empty() {
            Self::Runs(dt_s)
        } else if dt_s.abs() <= SHORTEST_STEP_S {
            Self::Stands
        } else {
            Self::Broken
        }
    }
}

/// What a field's filter remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Memory {
    /// The last centroid that counted, m.
    anchor: Option<Centroid>,
    /// The time since then, s.
    since_s: f64,
    /// Average of the steps' unit vectors.
    heading: Option<DVec2>,
}

/// What the filter says of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Filtered {
    pub(crate) flags: Flags,
    pub(crate) present: Outputs,
    /// m.
    pub(crate) displacement: DVec2,
    /// rad in (−π, π].
    pub(crate) direction: f64,
    /// m/s.
    pub(crate) speed: f64,
}

impl Filtered {
    /// The outputs, those that are not present with what stands for them.
    pub(crate) fn outputs(&self) -> [(Host, [f64; 2]); 3] {
        [
            (Host::FilteredDisplacement, self.displacement.to_array()),
            (Host::FilteredDirection, scalar(self.direction)),
            (Host::FilteredSpeed, scalar(self.speed)),
        ]
    }
}

impl FilterBound {
    /// The outputs' limits.
    pub(crate) fn limits(&self) -> [GivenLimit; 3] {
        [
            (Outputs::FILTERED_DISPLACEMENT, self.displacement),
            (Outputs::FILTERED_DIRECTION, self.direction),
            (Outputs::FILTERED_SPEED, self.speed),
        ]
    }
}

impl Memory {
    /// Forgets the contact that has ended.
    pub(crate) fn release(&mut self) {
        *self = Self::default();
    }

    /// Takes the next centroid of a contact, m.
    pub(crate) fn follow(&mut self, settings: &Settings, clock: Clock, centroid: Centroid) -> Filtered {
        let mut filtered = Filtered::default();
        let fresh = Self { anchor: Some(centroid), ..Self::default() };
        match (self.anchor, clock) {
            (None, _) => {
                *self = fresh;
                filtered.flags |= Flags::NO_PREVIOUS;
            }
            (Some(_), Clock::Broken) => {
                *self = fresh;
                filtered.flags |= Flags::BAD_DT;
            }
            (Some(_), Clock::Stands) => filtered.flags |= Flags::BAD_DT,
            (Some(from), Clock::Runs(dt_s)) => {
                self.since_s += dt_s;
                match settings.judge(from, centroid, 0.0).0 {
                    Choice::Held => filtered.flags |= Flags::HELD,
                    Choice::Jumped => {
                        *self = fresh;
                        filtered.flags |= Flags::JUMPED;
                    }
                    Choice::Counts => {
                        filtered.displacement = centroid.place - from.place;
                        filtered.speed = filtered.displacement.length() / self.since_s;
                        filtered.present |= Outputs::FILTERED_DISPLACEMENT | Outputs::FILTERED_SPEED;
                        let unit = filtered.displacement / filtered.displacement.length();
                        let old = self.heading.unwrap_or_default();
                        let heading = old + self.share(settings) * (unit - old);
                        *self = Self { heading: Some(heading), ..fresh };
                    }
                }
            }
        }
        match self.heading {
            Some(heading) if heading.length() > LEAST_HEADING => {
                // A zero below the axis would put π at −π.
                filtered.direction = libm::atan2(heading.y + 0.0, heading.x + 0.0);
                filtered.present |= Outputs::FILTERED_DIRECTION;
            }
            Some(_) => filtered.flags |= Flags::STILL,
            None => {}
        }
        filtered
    }

    /// How much of the next step goes into the average.
    fn share(&self, settings: &Settings) -> f64 {
        match self.heading {
            Some(_) if settings.time_constant_s > 0.0 => -libm::expm1(-self.since_s / settings.time_constant_s),
            _ => 1.0,
        }
    }
}

/// How far a filter that is fed single-precision centroids may be off.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FilterBound {
    /// Flags that may differ.
    pub(crate) in_doubt: Flags,
    /// As a distance, m.
    pub(crate) displacement: Limit,
    pub(crate) direction: Limit,
    pub(crate) speed: Limit,
    /// Whether another centroid may be the last that counted from now on.
    pub(crate) may_remember: bool,
}

/// What the bound of a field's next frame depends on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Doubt {
    right: Memory,
    /// How far the last centroid that counted may be off, m.
    anchor: f64,
    /// The same for the average.
    heading: f64,
}

impl Doubt {
    /// After a frame that left `memory` for certain.
    pub(crate) fn after(memory: &Memory) -> Self {
        Self { right: *memory, ..Self::default() }
    }

    /// Forgets the contact that has ended.
    pub(crate) fn release(&mut self) {
        *self = Self::default();
    }

    /// The bounds of the next frame of a contact, whose centroid is off by up to `place_bound` (m).
    pub(crate) fn follow(
        &mut self,
        settings: &Settings,
        clock: Clock,
        centroid: Centroid,
        place_bound: f64,
    ) -> FilterBound {
        let before = *self;
        self.right.follow(settings, clock, centroid);
        let fresh = Self { right: self.right, anchor: place_bound, heading: 0.0 };
        let mut bound = FilterBound::default();
        let (from, dt_s) = match (before.right.anchor, clock) {
            (None, _) | (Some(_), Clock::Broken) => {
                *self = fresh;
                return bound;
            }
            (Some(_), Clock::Stands) => return self.directed(bound),
            (Some(from), Clock::Runs(dt_s)) => (from, dt_s),
        };
        let step = centroid.place - from.place;
        // Beside f32's error, a few roundings of f64 on both sides.
        let moved = SLACK * (before.anchor + place_bound + U * U * (centroid.place.length() + from.place.length()));
        let (choice, in_doubt) = settings.judge(from, centroid, moved);
        if in_doubt {
            let in_doubt = Flags::HELD | Flags::JUMPED | Flags::STILL;
            let near = Limit::TooClose;
            return FilterBound { in_doubt, displacement: near, direction: near, speed: near, may_remember: true };
        }
        match choice {
            Choice::Held => {}
            Choice::Jumped => *self = fresh,
            Choice::Counts => {
                let since_s = before.right.since_s + dt_s;
                let share = Memory { since_s, ..before.right }.share(settings);
                let turned = (moved / step.length()).min(1.0).asin() + U * U;
                *self = Self { heading: before.heading + share * (turned - before.heading), ..fresh };
                bound.displacement = Limit::Within(moved);
                bound.speed = Limit::Within((moved + U * U * step.length()) / since_s);
            }
        }
        self.directed(bound)
    }

    /// Adds the bound of the direction of the average.
    fn directed(&self, mut bound: FilterBound) -> FilterBound {
        if let Some(length) = self.right.heading.map(DVec2::length) {
            let near = (length - LEAST_HEADING).abs() <= self.heading;
            let angle = (self.heading < 0.5 * length).then(|| (self.heading / length).asin() + U * U);
            bound.direction = Limit::from_bound(angle, length > LEAST_HEADING, near);
            if near {
                bound.in_doubt |= Flags::STILL;
            }
        }
        bound
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;

    fn settings(window_m: [f64; 2], time_constant_s: f64) -> Settings {
        let still = Still { least: 1e-9, ..Still::default() };
        Settings { window_m, by: FilterBy::Distance, time_constant_s, over_s: None, still, unit_m: 1.0 }
    }

    fn at(place: DVec2) -> Centroid {
        Centroid { place, pressed: 1 }
    }

    /// A filter being fed.
    struct Fed {
        settings: Settings,
        memory: Memory,
    }

    impl Fed {
        fn new(settings: Settings) -> Self {
            Self { settings, memory: Memory::default() }
        }

        fn push(&mut self, dt_s: f64, u: f64, v: f64) -> Filtered {
            self.memory.follow(&self.settings, Clock::Runs(dt_s), at(DVec2::new(u, v)))
        }
    }

    fn direction(filtered: &Filtered) -> Option<f64> {
        filtered.present.contains(Outputs::FILTERED_DIRECTION).then_some(filtered.direction)
    }

    #[test]
    fn smoothing_takes_its_time_and_no_notice_of_the_seam() {
        let mut fed = Fed::new(settings([0.0, 10.0], 0.2));
        let mut place = [0.0_f64, 0.0];
        fed.push(0.1, 0.0, 0.0);
        let mut step = |dt_s: f64, angle: f64| {
            place = [place[0] + libm::cos(angle), place[1] + libm::sin(angle)];
            direction(&fed.push(dt_s, place[0], place[1])).unwrap()
        };
        assert_eq!(step(0.1, 0.0), 0.0);
        let turned = step(0.1, FRAC_PI_2);
        // The share of a step of τ/2 is 1 − e^(−1/2) = 0.3935: atan2(0.3935, 0.6065).
        assert!((turned - 0.575_6).abs() < 1e-3, "{turned}");
        for i in 0..40 {
            let seam = step(1.0, if i % 2 == 0 { PI - 0.1 } else { -PI + 0.1 });
            assert!(i == 0 || seam.abs() > PI - 0.2, "{seam}");
        }
    }

    #[test]
    fn steps_that_cancel_out_have_no_direction() {
        // At Δt = τ ln 2 a step has half of the say.
        let mut fed = Fed::new(settings([1e-3, 1.0], 0.1));
        fed.push(0.1, 0.0, 0.0);
        fed.push(0.1, 0.01, 0.0);
        let back = fed.push(0.1 * std::f64::consts::LN_2, 0.0, 0.0);
        assert_eq!((back.flags, direction(&back)), (Flags::STILL, None));
        assert_eq!(back.present, Outputs::FILTERED_DISPLACEMENT | Outputs::FILTERED_SPEED);
        assert_eq!(fed.push(0.1, 0.0, 0.0).flags, Flags::STILL | Flags::HELD);
        assert!(direction(&fed.push(0.1, 0.0, 0.01)).is_some());
    }

    #[test]
    fn a_step_that_cannot_be_used_stands_or_breaks_the_clock() {
        assert_eq!(Clock::new(0.1, Flags::empty()), Clock::Runs(0.1));
        assert_eq!([0.0, 1e-13].map(|dt_s| Clock::new(dt_s, Flags::BAD_DT)), [Clock::Stands; 2]);
        assert_eq!([-0.1, 3600.0].map(|dt_s| Clock::new(dt_s, Flags::BAD_DT)), [Clock::Broken; 2]);
    }

    /// Two filters over the same path, one fed places that are off by up to `off`, held to the bounds.
    fn within_bounds(settings: Settings, off: f64, claimed: f64) -> Result<[u32; 2], String> {
        let mut seed = 1_u32;
        let mut random = move || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed >> 8) / f64::from(1 << 23) - 1.0
        };
        let (mut right, mut other, mut doubt) = (Memory::default(), Memory::default(), Doubt::default());
        let mut place = DVec2::ZERO;
        let [mut compared, mut doubted] = [0, 0];
        for _ in 0..4000 {
            place = (place + 2e-3 * DVec2::new(random(), random())).clamp(DVec2::splat(-0.05), DVec2::splat(0.05));
            let clock = match random() {
                x if x > 0.99 => Clock::Broken,
                x if x > 0.95 => Clock::Stands,
                x => Clock::Runs(0.02 + 0.01 * x),
            };
            let turn = PI * random();
            let near = place + off * DVec2::new(turn.cos(), turn.sin());
            if random() > 0.98 {
                (right, other, doubt) = Default::default();
            }
            let (a, b) = (right.follow(&settings, clock, at(place)), other.follow(&settings, clock, at(near)));
            let bound = doubt.follow(&settings, clock, at(place), claimed);
            if !((a.flags ^ b.flags) - bound.in_doubt).is_empty() {
                return Err(format!("{:?} {:?}", a.flags, b.flags));
            }
            doubted += u32::from(!bound.in_doubt.is_empty());
            if bound.may_remember {
                (right, doubt) = (other, Doubt::after(&other));
            }
            let apart = (a.displacement - b.displacement).length();
            let turned = super::super::angle::between_directions(a.direction, b.direction);
            let faster = (a.speed - b.speed).abs();
            for (error, limit, output) in [
                (apart, bound.displacement, Outputs::FILTERED_DISPLACEMENT),
                (turned, bound.direction, Outputs::FILTERED_DIRECTION),
                (faster, bound.speed, Outputs::FILTERED_SPEED),
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
        for by in [FilterBy::Distance, FilterBy::Radial] {
            for time_constant_s in [0.0, 0.1] {
                let settings = Settings { by, ..settings([1e-3, 4e-3], time_constant_s) };
                for off in [1e-9, 1e-6, 1e-5] {
                    let [compared, doubted] = within_bounds(settings, off, off).unwrap();
                    assert!(compared > 1000, "{by:?} {off}: {compared} compared, {doubted} in doubt");
                    assert!(off < 1e-7 || doubted > 0);
                }
                // Negative control: a bound that claims a third of the error does not hold.
                assert!(within_bounds(settings, 1e-5, 3e-6).is_err());
            }
        }
    }
}
