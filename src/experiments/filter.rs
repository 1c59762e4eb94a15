//! The paper's spatial filter on the motion of a centroid, and a temporal one on its direction.

/// Smooths the direction in which a centroid moves.
///
/// **In space.** A centroid counts when its distance ΔR from the last one that counted lies in a window. Nearer, it is
/// held back until the motion has added up, so that slow motion passes in the end while jitter does not. Farther, it is
/// another touch rather than motion: filtering starts anew there, without a direction.
///
/// **In time.** Each step that counts turns the direction towards its own by 1 − exp(−Δt/τ), Δt being the time since the
/// step before. Unit vectors are averaged, not angles, so that nothing happens at the seam of ±π.
#[derive(Clone, Debug)]
pub(super) struct DirectionFilter {
    window_m: [f64; 2],
    time_constant_s: f64,
    /// Time and place of the last centroid that counted.
    anchor: Option<(f64, [f64; 2])>,
    /// Average of the steps' unit vectors.
    heading: Option<[f64; 2]>,
}

impl DirectionFilter {
    /// A filter with the window's two ends, m, and τ, s; with τ = 0 each step stands for itself.
    pub(super) fn new(window_m: [f64; 2], time_constant_s: f64) -> Self {
        Self { window_m, time_constant_s, anchor: None, heading: None }
    }

    /// Takes the centroid at `t_s`, absent without contact, and gives the filtered direction, rad in (−π, π].
    pub(super) fn push(&mut self, t_s: f64, centroid: Option<[f64; 2]>) -> Option<f64> {
        let Some(place) = centroid else {
            (self.anchor, self.heading) = (None, None);
            return None;
        };
        let Some((before_s, before)) = self.anchor else {
            self.anchor = Some((t_s, place));
            return None;
        };
        let step = [place[0] - before[0], place[1] - before[1]];
        let distance_m = libm::hypot(step[0], step[1]);
        if distance_m > self.window_m[1] {
            (self.anchor, self.heading) = (Some((t_s, place)), None);
        } else if distance_m >= self.window_m[0] && distance_m > 0.0 {
            let unit = step.map(|x| x / distance_m);
            let share = match self.heading {
                Some(_) if self.time_constant_s > 0.0 => -libm::expm1(-(t_s - before_s) / self.time_constant_s),
                _ => 1.0,
            };
            let old = self.heading.unwrap_or([0.0; 2]);
            self.heading = Some([0, 1].map(|i| old[i] + share * (unit[i] - old[i])));
            self.anchor = Some((t_s, place));
        }
        // A zero below the axis would put π at −π.
        self.heading.map(|heading| libm::atan2(heading[1] + 0.0, heading[0]))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;

    #[test]
    fn slow_motion_passes_in_the_end_and_jitter_does_not() {
        let mut filter = DirectionFilter::new([1e-3, 5e-3], 0.0);
        // 0.3 mm a frame: the fourth is the first that has come a millimetre from the start.
        let seen: Vec<_> =
            (0..6).map(|i| filter.push(0.1 * f64::from(i), Some([0.0, 0.3e-3 * f64::from(i)]))).collect();
        assert_eq!(seen[..4], [None; 4]);
        assert!(seen[4..].iter().all(|direction| (direction.unwrap() - FRAC_PI_2).abs() < 1e-12));
        let mut filter = DirectionFilter::new([1e-3, 5e-3], 0.0);
        assert!((0..50).all(|i| filter.push(0.1 * f64::from(i), Some([0.4e-3 * f64::from(i % 3), 0.0])).is_none()));
    }

    #[test]
    fn a_jump_starts_anew_where_it_ends() {
        let mut filter = DirectionFilter::new([1e-3, 5e-3], 0.0);
        filter.push(0.0, Some([0.0, 0.0]));
        assert_eq!(filter.push(0.1, Some([2e-3, 0.0])), Some(0.0));
        assert_eq!(filter.push(0.2, Some([2e-3, 9e-3])), None);
        // From where it landed, not from where it left.
        assert!((filter.push(0.3, Some([2e-3, 7e-3])).unwrap() + FRAC_PI_2).abs() < 1e-12);
        assert_eq!(filter.push(0.4, None), None);
        assert_eq!(filter.push(0.5, Some([0.0, 7e-3])), None, "a new contact has no past");
    }

    #[test]
    fn smoothing_takes_its_time_and_no_notice_of_the_seam() {
        let mut filter = DirectionFilter::new([0.0, 10.0], 0.2);
        let mut place = [0.0_f64, 0.0];
        filter.push(0.0, Some(place));
        let mut step = |t_s: f64, angle: f64| {
            place = [place[0] + libm::cos(angle), place[1] + libm::sin(angle)];
            filter.push(t_s, Some(place)).unwrap()
        };
        assert_eq!(step(0.1, 0.0), 0.0);
        let turned = step(0.2, FRAC_PI_2);
        // The share of a step of τ/2 is 1 − e^(−1/2) = 0.3935: atan2(0.3935, 0.6065).
        assert!((turned - 0.575_6).abs() < 1e-3, "{turned}");
        for i in 0..40 {
            let seam = step(10.0 + f64::from(i), if i % 2 == 0 { PI - 0.1 } else { -PI + 0.1 });
            assert!(i == 0 || seam.abs() > PI - 0.2, "{seam}");
        }
    }
}
