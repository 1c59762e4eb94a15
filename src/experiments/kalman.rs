//! A Kalman filter with constant velocity, with which motion over a time is compared.

/// A steady one: the process noise that it takes for granted is the one that gives it a certain lag.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kalman {
    dt_s: f64,
    /// Density of the acceleration's noise, over the variance of a place.
    process: f64,
    state: Option<State>,
}

#[derive(Clone, Copy, Debug)]
struct State {
    place: [f64; 2],
    velocity: [f64; 2],
    /// Of place; of both; of velocity, over the variance of a place.
    covariance: [f64; 3],
}

impl Kalman {
    fn new(process: f64, dt_s: f64) -> Self {
        Self { dt_s, process, state: None }
    }

    /// The one whose velocity lags by `lag_s` behind a steady acceleration.
    pub(super) fn with_lag(lag_s: f64, dt_s: f64) -> Self {
        let (mut low, mut high) = (1e-2_f64, 1e10_f64);
        for _ in 0..60 {
            let middle = (low * high).sqrt();
            *(if Self::new(middle, dt_s).lag_s() > lag_s { &mut low } else { &mut high }) = middle;
        }
        Self::new((low * high).sqrt(), dt_s)
    }

    fn lag_s(mut self) -> f64 {
        let (mut t_s, mut lag_s) = (0.0, 0.0);
        while t_s < 10.0 {
            lag_s = t_s - self.follow(Some([0.5 * t_s * t_s, 0.0])).map_or(0.0, |velocity| velocity[0]);
            t_s += self.dt_s;
        }
        lag_s
    }

    /// The velocity after the next frame's centroid, from the second of a contact on.
    pub(super) fn follow(&mut self, place: Option<[f64; 2]>) -> Option<[f64; 2]> {
        let Some(place) = place else {
            self.state = None;
            return None;
        };
        let Some(State { place: was, velocity, covariance: [a, b, c] }) = self.state else {
            self.state = Some(State { place, velocity: [0.0; 2], covariance: [1.0, 0.0, 1e4] });
            return None;
        };
        let (dt, q) = (self.dt_s, self.process);
        let [a, b, c] =
            [a + 2.0 * dt * b + dt * dt * c + q * dt * dt * dt / 3.0, b + dt * c + q * dt * dt / 2.0, c + q * dt];
        let [of_place, of_velocity] = [a / (a + 1.0), b / (a + 1.0)];
        // Joseph's form of (1 − KH)P: it stays symmetric and positive.
        let rest = 1.0 - of_place;
        let covariance = [
            rest * rest * a + of_place * of_place,
            rest * (b - of_velocity * a) + of_place * of_velocity,
            c - 2.0 * of_velocity * b + of_velocity * of_velocity * (a + 1.0),
        ];
        let predicted = [0, 1].map(|axis| was[axis] + dt * velocity[axis]);
        let off = [0, 1].map(|axis| place[axis] - predicted[axis]);
        let state = State {
            place: [0, 1].map(|axis| predicted[axis] + of_place * off[axis]),
            velocity: [0, 1].map(|axis| velocity[axis] + of_velocity * off[axis]),
            covariance,
        };
        self.state = Some(state);
        Some(state.velocity)
    }
}

/// The lag, s, and by what share of the speed the velocity goes below 0 when a steady motion stops.
pub(super) fn response(lag_s: f64, dt_s: f64) -> (f64, f64) {
    let mut filter = Kalman::with_lag(lag_s, dt_s);
    let lag_s = filter.lag_s();
    let mut lowest = 0.0_f64;
    for frame in 0..1000 {
        let place = f64::from(frame.min(500));
        let velocity = filter.follow(Some([place * dt_s, 0.0])).map_or(0.0, |velocity| velocity[0]);
        if frame > 500 {
            lowest = lowest.min(velocity);
        }
    }
    (lag_s, -lowest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_lags_as_asked_and_finds_a_steady_velocity() {
        for lag_s in [0.05, 0.1, 0.2] {
            assert!((Kalman::with_lag(lag_s, 0.02).lag_s() - lag_s).abs() < 1e-6);
        }
        let mut filter = Kalman::with_lag(0.1, 0.02);
        let mut found = None;
        for frame in 0..200 {
            let at = f64::from(frame) * 0.02;
            found = filter.follow(Some([3.0 * at, -at]));
        }
        let [u, v] = found.unwrap();
        assert!((u - 3.0).abs() < 1e-6 && (v + 1.0).abs() < 1e-6);
        assert_eq!(filter.follow(None), None);
        assert_eq!(filter.follow(Some([0.0; 2])), None, "a contact begins anew");
        // A filter of second order with damping 1/√2 overshoots by e^−π.
        let (_, overshoot) = response(0.1, 0.02);
        assert!((0.03..0.06).contains(&overshoot), "{overshoot}");
    }
}
