//! Where touches of the whole body were in the last second.

use std::collections::VecDeque;

use glam::DVec3;

use super::{Touch, TouchFrame};

/// Time that trails go back, s.
const TRAIL_S: f64 = 1.0;
/// Time between two places of a trail at least, s.
const APART_S: f64 = 1.0 / 32.0;
/// What of a time may be missing for rounding, as a share.
const ROUNDING: f64 = 1e-6;

/// A place where a touch was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrailPoint {
    /// Of the touch.
    pub(crate) id: u64,
    /// When it was there, s.
    pub t_s: f64,
    /// The link in whose frame the place is; `None` is the world.
    pub link: Option<u32>,
    /// The place, m.
    pub position: DVec3,
}

/// The trails of all touches, in bounded memory.
#[derive(Debug, Default, PartialEq)]
pub struct TouchTrails {
    /// The oldest first.
    points: VecDeque<TrailPoint>,
}

impl Clone for TouchTrails {
    fn clone(&self) -> Self {
        Self { points: self.points.clone() }
    }

    // In memory that is used again.
    fn clone_from(&mut self, other: &Self) {
        self.points.clone_from(&other.points);
    }
}

impl TouchTrails {
    /// Takes the touches of the frame at `t_s`, and forgets what is older than a second. After a jump back it forgets what came later.
    pub fn follow(&mut self, t_s: f64, found: &TouchFrame) {
        let link = |touch: &Touch| (!touch.in_world).then_some(touch.link);
        self.add(t_s, found.touches.iter().map(|touch| (touch.id, link(touch), touch.best_place())));
    }

    fn add(&mut self, t_s: f64, touches: impl Iterator<Item = (u64, Option<u32>, DVec3)>) {
        while self.points.back().is_some_and(|last| last.t_s >= t_s) {
            self.points.pop_back();
        }
        while self.points.front().is_some_and(|first| first.t_s < t_s - TRAIL_S) {
            self.points.pop_front();
        }
        let is_due = self.points.back().is_none_or(|last| t_s - last.t_s >= APART_S * (1.0 - ROUNDING));
        if is_due {
            self.points.extend(touches.map(|(id, link, position)| TrailPoint { id, t_s, link, position }));
        }
    }

    /// The trail of the touch `id`, the oldest place first.
    pub fn trail(&self, id: u64) -> impl Iterator<Item = &TrailPoint> {
        self.points.iter().filter(move |point| point.id == id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn add(trails: &mut TouchTrails, t_s: f64, x: f64, ids: &[u64]) {
        trails.add(t_s, ids.iter().map(|&id| (id, Some(3), DVec3::new(x, 0.0, 0.0))));
    }

    #[test]
    fn a_trail_goes_back_a_second_at_any_rate() {
        for rate_hz in [1000.0, 32.0, 7.0] {
            let mut trails = TouchTrails::default();
            for frame in 0..3000 {
                let t_s = f64::from(frame) / rate_hz;
                add(&mut trails, t_s, t_s, if t_s < 1.5 { &[4] } else { &[4, 5] });
            }
            let last_s = 2999.0 / rate_hz;
            let times: Vec<f64> = trails.trail(4).map(|point| point.t_s).collect();
            assert!(times.is_sorted() && times.len() <= 34, "{rate_hz} Hz: {}", times.len());
            assert!(times[0] >= last_s - 1.0 && times[0] <= last_s - 1.0 + 1.0 / 7.0 + 1e-9, "{rate_hz} Hz: {times:?}");
            assert!(trails.trail(4).all(|point| point.position.x == point.t_s && point.link == Some(3)));
            assert_eq!((trails.trail(5).count(), trails.trail(6).count()), (times.len(), 0));
        }
    }

    #[test]
    fn after_a_jump_back_nothing_later_is_left() {
        let mut trails = TouchTrails::default();
        for frame in 0..100 {
            add(&mut trails, f64::from(frame) * 0.125, 0.0, &[1]);
        }
        add(&mut trails, 12.0, 0.5, &[1]);
        let points: Vec<&TrailPoint> = trails.trail(1).collect();
        assert!(points.is_sorted_by(|a, b| a.t_s < b.t_s) && points[0].t_s == 11.375, "{points:?}");
        assert_eq!((points.len(), points[5].t_s, points[5].position.x), (6, 12.0, 0.5));
        add(&mut trails, 3.0, 0.6, &[1]);
        assert!(trails.trail(1).map(|point| point.t_s).eq([3.0]));
        // A gap of over a second leaves the newest place alone.
        add(&mut trails, 20.0, 0.7, &[1]);
        assert_eq!(trails.trail(1).count(), 1);
        // Nothing is touched: there is nothing to add, and the old places go.
        add(&mut trails, 22.0, 0.7, &[]);
        assert_eq!(trails, TouchTrails::default());
    }

    #[test]
    fn a_copy_uses_its_memory_again() {
        let (mut trails, mut copy) = (TouchTrails::default(), TouchTrails::default());
        add(&mut trails, 0.0, 0.0, &[1, 2]);
        copy.clone_from(&trails);
        assert_eq!(copy, trails);
        let measured = allocation_counter::measure(|| copy.clone_from(&trails));
        assert_eq!(measured.count_total, 0);
    }
}
