//! Common drift: the median drift of the untouched taxels of a board, of a link, of the body.
//!
//! Taxels with a common temperature drift by about the same number of counts. The level of a group is the median of raw −
//! the file's baseline over the taxels that are untouched both in this epoch and in the previous one; its step between
//! epochs is the group's drift. Steps of a median add up, so that rounding by the converter does not accumulate.

/// Minimum number of untouched taxels for an estimate: the median of three tolerates one outlier.
pub const MIN_UNTOUCHED: usize = 3;

/// A drift estimated from other taxels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Drift {
    /// Change since the previous epoch, raw units.
    pub(super) step: f64,
    /// Its mean rate, raw units a second.
    pub(super) rate: f64,
}

/// Taxels in groups with a common temperature.
#[derive(Clone, Debug)]
struct Grouping {
    /// Per taxel its group, if any.
    group_of: Vec<Option<usize>>,
    /// Per taxel its level at its group's last estimate, if it was untouched then.
    before: Vec<Option<f64>>,
    groups: Vec<Group>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Group {
    /// Time of the last estimate, s.
    known_s: f64,
    /// The mean rate, raw units a second.
    rate: f64,
}

#[derive(Clone, Debug)]
pub(super) struct CommonDrift {
    groupings: Vec<Grouping>,
    /// Per taxel the time up to which its drift is estimated, s.
    estimated_until_s: Vec<f64>,
}

impl CommonDrift {
    /// `groupings`, the most specific first, have per taxel its group or `None`.
    pub(super) fn new(groupings: Vec<Vec<Option<usize>>>) -> Self {
        let channels = groupings.first().map_or(0, Vec::len);
        let grouping = |group_of: Vec<Option<usize>>| {
            let groups = group_of.iter().flatten().max().map_or(0, |last| last + 1);
            Grouping { group_of, before: vec![None; channels], groups: vec![Group::default(); groups] }
        };
        let groupings = groupings.into_iter().map(grouping).collect();
        Self { groupings, estimated_until_s: vec![f64::NEG_INFINITY; channels] }
    }

    /// Per taxel the drift at `now_s` of the most specific of its groups that has an estimate. `levels` has values for
    /// untouched taxels; rates are averaged over `rate_s`.
    pub(super) fn estimate(&mut self, levels: &[Option<f64>], now_s: f64, rate_s: f64) -> Vec<Option<Drift>> {
        let mut drift: Vec<Option<Drift>> = vec![None; levels.len()];
        for grouping in &mut self.groupings {
            let estimates = grouping.update(levels, now_s, rate_s);
            for (channel, drift) in drift.iter_mut().enumerate().filter(|(_, drift)| drift.is_none()) {
                let Some((since_s, all)) = grouping.group_of[channel].and_then(|group| estimates[group]) else {
                    continue;
                };
                // The part of the time that another group has covered does not count again.
                let new = ((now_s - self.estimated_until_s[channel]) / (now_s - since_s)).clamp(0.0, 1.0);
                *drift = Some(Drift { step: if new.is_nan() { 0.0 } else { all.step * new }, ..all });
            }
        }
        for (until_s, _) in self.estimated_until_s.iter_mut().zip(&drift).filter(|(_, drift)| drift.is_some()) {
            *until_s = now_s;
        }
        drift
    }
}

impl Grouping {
    /// Per group the time since which it has drifted, and its drift at `now_s`.
    fn update(&mut self, levels: &[Option<f64>], now_s: f64, rate_s: f64) -> Vec<Option<(f64, Drift)>> {
        let mut levels_pairs = vec![Vec::new(); self.groups.len()];
        let mut untouched = vec![0; self.groups.len()];
        for ((group, before), now) in self.group_of.iter().zip(&self.before).zip(levels) {
            if let (Some(group), Some(now)) = (*group, *now) {
                untouched[group] += 1;
                levels_pairs[group].extend(before.map(|before| [before, now]));
            }
        }
        // A group with too few untouched taxels keeps its old levels: they give the drift over the pause once there are enough.
        for (before, (group, now)) in self.before.iter_mut().zip(self.group_of.iter().zip(levels)) {
            if group.is_some_and(|group| untouched[group] >= MIN_UNTOUCHED) {
                *before = *now;
            }
        }
        let mut estimates = Vec::with_capacity(levels_pairs.len());
        for ((group, levels_pairs), untouched) in self.groups.iter_mut().zip(&levels_pairs).zip(untouched) {
            let since_s = group.known_s;
            let step = step(levels_pairs);
            if let Some(step) = step.filter(|_| now_s > since_s) {
                let share = 1.0 - libm::exp(-(now_s - since_s) / rate_s);
                group.rate += share * (step / (now_s - since_s) - group.rate);
            }
            if untouched >= MIN_UNTOUCHED {
                group.known_s = now_s;
            }
            estimates.push(step.map(|step| (since_s, Drift { step, rate: group.rate })));
        }
        estimates
    }
}

/// The change of the median; `None` for too few taxels.
fn step(levels_pairs: &[[f64; 2]]) -> Option<f64> {
    let median = |of: usize| {
        let mut levels: Vec<f64> = levels_pairs.iter().map(|peer| peer[of]).collect();
        levels.sort_by(f64::total_cmp);
        let middle = levels.len() / 2;
        if levels.len() % 2 == 1 { levels[middle] } else { 0.5 * (levels[middle - 1] + levels[middle]) }
    };
    (levels_pairs.len() >= MIN_UNTOUCHED).then(|| median(1) - median(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_group_that_knows_tells() {
        let boards = vec![Some(0), Some(0), Some(0), Some(1), Some(1), None];
        let mut common = CommonDrift::new(vec![boards, vec![Some(0); 6]]);
        assert_eq!(common.estimate(&[0.0, 5.0, 3.0, 0.0, 0.0, 0.0].map(Some), 10.0, 1e-9), [None; 6]);
        // A liar does not move the median; it is one of levels, not of steps.
        let drift = common.estimate(&[Some(1.0), Some(6.0), Some(90.0), Some(3.0), Some(3.0), None], 12.0, 1e-9);
        assert_eq!(drift, [Some(Drift { step: 3.0, rate: 1.5 }); 6], "two are too few, so the body tells");
        assert_eq!(common.estimate(&[None; 6], 14.0, 1e-9), [None; 6]);
    }

    #[test]
    fn what_drifts_while_nobody_is_untouched_is_reported_later_and_once() {
        let mut common = CommonDrift::new(vec![vec![Some(0), Some(0), Some(0), None, None, None], vec![Some(0); 6]]);
        let estimate = |common: &mut CommonDrift, board: bool, others: bool, level: f64, now_s: f64| {
            let levels: Vec<_> = (0..6).map(|of| (if of < 3 { board } else { others }).then_some(level)).collect();
            common.estimate(&levels, now_s, 60.0)[0].map(|drift| drift.step)
        };
        assert_eq!(estimate(&mut common, true, true, 0.0, 0.0), None);
        assert_eq!(estimate(&mut common, true, true, 1.0, 1.0), Some(1.0));
        assert_eq!(estimate(&mut common, false, false, 2.0, 2.0), None);
        assert_eq!(estimate(&mut common, true, true, 3.0, 3.0), Some(2.0));
        // The others tell while the board is touched, and it does not tell that again.
        assert_eq!(estimate(&mut common, false, true, 4.0, 4.0), Some(1.0));
        assert_eq!(estimate(&mut common, true, true, 5.0, 5.0), Some(1.0));
    }

    #[test]
    fn whole_counts_add_up_to_the_drift() {
        // 1.4 counts a minute, seen in whole counts: most epochs have no step at all.
        let mut common = CommonDrift::new(vec![vec![Some(0); 9]]);
        let level = |taxel: usize, second: usize| (second as f64 * 1.4 / 60.0 + taxel as f64 / 9.0).floor();
        let mut sum = 0.0;
        for second in 0..1200 {
            let levels: Vec<_> = (0..9).map(|taxel| Some(level(taxel, second))).collect();
            sum += common.estimate(&levels, second as f64, 15.0)[0].map_or(0.0, |drift| drift.step);
        }
        assert!((sum - 28.0_f64).abs() <= 1.0, "{sum}");
    }
}
