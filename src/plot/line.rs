//! The line of a series as it is drawn: at each dot across the least and the most of its time, so that no peak is lost and no dot is
//! drawn over again and again.

use super::series::Series;

/// Between two frames a line breaks if they are so many usual steps apart, as on the page, and so many dots across: what is shorter
/// cannot be seen.
const GAP_STEPS: f64 = 3.0;
const GAP_DOTS: i32 = 8;

/// What a plot shows of a quantity at one column of dots.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stretch {
    x: i32,
    low: f64,
    high: f64,
}

/// The stretches of `series`, one list for each part that is drawn without a break. An angle with a `period` that goes past its end
/// comes back at the other one, which is not motion through all that is between: there the line breaks. It breaks too where time goes
/// back, and where no frame is for longer than usual.
fn stretches(series: &Series, period: Option<f64>, x: impl Fn(f64) -> i32) -> Vec<Vec<Stretch>> {
    let most_step = period.map_or(f64::INFINITY, |period| period / 2.0);
    let mut runs: Vec<Vec<Stretch>> = Vec::new();
    // Whether the next one begins a run.
    let mut breaks = true;
    let gap_s = GAP_STEPS * usual_step_s(series);
    let mut before: Option<(f64, i32)> = None;
    for bucket in &series.buckets {
        let at = (bucket.t_s, x(bucket.t_s));
        breaks |= before
            .replace(at)
            .is_some_and(|(t_s, x)| bucket.t_s < t_s || (bucket.t_s - t_s > gap_s && at.1 - x >= GAP_DOTS));
        let Some([low, high]) = bucket.range else {
            breaks = true;
            continue;
        };
        let new = Stretch { x: at.1, low, high };
        let last = runs.last_mut().filter(|_| !breaks);
        breaks = high - low > most_step;
        if breaks {
            // Both ends of an angle in one bucket.
            runs.push(vec![Stretch { high: low, ..new }]);
            runs.push(vec![Stretch { low: high, ..new }]);
            continue;
        }
        match last {
            Some(run) => match run.last().copied() {
                Some(before) if (new.low - before.high).max(before.low - new.high) > most_step => runs.push(vec![new]),
                Some(before) if before.x == new.x && before.high.max(high) - before.low.min(low) <= most_step => {
                    let joined = Stretch { low: before.low.min(low), high: before.high.max(high), ..new };
                    run.pop();
                    run.push(joined);
                }
                _ => run.push(new),
            },
            None => runs.push(vec![new]),
        }
    }
    runs
}

/// The median of the steps forward in time, s; infinite if there is none.
fn usual_step_s(series: &Series) -> f64 {
    let steps = series.buckets.windows(2).map(|pair| pair[1].t_s - pair[0].t_s);
    let mut steps: Vec<f64> = steps.filter(|&step_s| step_s > 0.0).collect();
    let middle = steps.len() / 2;
    if steps.is_empty() { f64::INFINITY } else { *steps.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// The points of the line of `series`, (right, down) in dots, one list for each part that is drawn without a break: at most two at
/// a dot across. `period` is that of an angle.
pub(super) fn points(
    series: &Series,
    period: Option<f64>,
    x: impl Fn(f64) -> i32,
    y: impl Fn(f64) -> i32,
) -> Vec<Vec<(i32, i32)>> {
    let runs = stretches(series, period, x);
    let line = |run: &Vec<Stretch>| {
        let mut line: Vec<(i32, i32)> = Vec::with_capacity(2 * run.len());
        for &Stretch { x, low, high } in run {
            let (low, high) = (y(low), y(high));
            let end = line.last().map_or(low, |&(_, end)| end);
            // From the nearer end to the other.
            let [first, last] = if (end - low).abs() <= (end - high).abs() { [low, high] } else { [high, low] };
            line.push((x, first));
            if last != first {
                line.push((x, last));
            }
        }
        line
    };
    runs.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(values: impl IntoIterator<Item = Option<f64>>) -> Series {
        let mut series = Series::default();
        values.into_iter().enumerate().for_each(|(at, value)| series.push(at as f64, value));
        series
    }

    #[test]
    fn a_dot_across_has_one_vertical_line_from_least_to_most() {
        let saw = series((0..2000).map(|at| Some(f64::from(at % 7))));
        let lines = points(&saw, None, |t| (t / 20.0) as i32, |value| -(value as i32));
        assert_eq!(lines.len(), 1);
        for x in 0..100 {
            let at: Vec<i32> = lines[0].iter().filter(|point| point.0 == x).map(|point| point.1).collect();
            assert!(at.len() == 2 && at.iter().min() == Some(&-6) && at.iter().max() == Some(&0), "{x}: {at:?}");
        }
        assert!(lines[0].windows(2).all(|pair| pair[0].0 <= pair[1].0));
        // From one dot to the next it goes to the nearer end: never over the whole height twice.
        assert!(lines[0].chunks(2).zip(lines[0].chunks(2).skip(1)).all(|(one, next)| one[1].1 == next[0].1));
    }

    #[test]
    fn a_line_breaks_where_nothing_is_and_where_an_angle_goes_past_its_end() {
        let gap = series([Some(1.0), Some(2.0), None, Some(4.0)]);
        let plain = points(&gap, None, |t| t as i32, |value| value as i32);
        assert_eq!(plain, [vec![(0, 1), (1, 2)], vec![(3, 4)]]);
        let degrees = |turn: f64| turn.to_radians();
        let turning = series([170.0, 178.0, 3.0, 10.0].map(|turn| Some(degrees(turn))));
        let drawn = |period| points(&turning, period, |t| t as i32, |value| value.to_degrees().round() as i32);
        assert_eq!(drawn(Some(std::f64::consts::PI)), [vec![(0, 170), (1, 178)], vec![(2, 3), (3, 10)]]);
        assert_eq!(drawn(None).len(), 1, "a value that is not an angle goes through");
        // At one dot across too, with nothing between its ends.
        let close = points(&turning, Some(std::f64::consts::PI), |_| 0, |value| value.to_degrees().round() as i32);
        assert_eq!(close, [vec![(0, 170), (0, 178)], vec![(0, 3), (0, 10)]]);
    }

    #[test]
    fn a_line_breaks_where_time_goes_back_and_where_no_frame_is() {
        let times = [0.0, 0.1, 0.2, 3.2, 3.3, 3.4, 2.0, 2.1, 2.3, 2.4];
        let mut series = Series::default();
        times.into_iter().zip(0..).for_each(|(t_s, value)| series.push(t_s, Some(f64::from(value))));
        let drawn = |dots: f64| points(&series, None, |t| (t * dots).round() as i32, |value| value as i32);
        let runs: Vec<Vec<i32>> =
            drawn(100.0).iter().map(|run| run.iter().map(|&(_, value)| value).collect()).collect();
        // A step of twice the usual length is no gap.
        assert_eq!(runs, [vec![0, 1, 2], vec![3, 4, 5], vec![6, 7, 8, 9]]);
        // A gap that cannot be seen is none, and time goes back all the same.
        assert_eq!(drawn(2.0).len(), 2);
    }

    #[test]
    fn frames_that_come_in_bunches_have_one_line() {
        // 8 frames in a millisecond, every 16 ms, for 10 s on 1500 dots.
        let mut series = Series::default();
        for bunch in 0..625 {
            (0..8).for_each(|frame| series.push(f64::from(bunch) * 0.016 + f64::from(frame) * 1e-4, Some(1.0)));
        }
        assert_eq!(points(&series, None, |t| (t * 150.0) as i32, |value| value as i32).len(), 1);
    }
}
