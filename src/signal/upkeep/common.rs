//! What drifts together: the median drift of the untouched taxels of a board, of a link, of the body.
//!
//! Taxels that are warmed together drift together, by about as many counts where they have the same converter. Per group,
//! the level is the median of raw − the file's baseline over the taxels that are known to be untouched both in this epoch
//! and in the one before. Its step from epoch to epoch is the drift of all. Steps of a median add up to what the median
//! has gone, so that whole counts of a converter cost no more than a count in the end, however slow the drift is.

/// Fewer untouched taxels than this tell no drift: of three the median bears one that is wrong.
pub(super) const LEAST: usize = 3;

/// The drift that a taxel is told by others.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Told {
    /// Since the epoch before, raw units.
    pub(super) step: f64,
    /// Its mean rate, raw units a second.
    pub(super) rate: f64,
}

/// Taxels in groups that are warmed together.
#[derive(Clone, Debug)]
struct Grouping {
    /// Per channel, its group, if it is in one.
    group_of: Vec<Option<usize>>,
    /// Per channel, its level when its group was known last, where it was untouched then.
    before: Vec<Option<f64>>,
    groups: Vec<Group>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Group {
    /// When it was known last, s.
    known_s: f64,
    /// The mean rate, raw units a second.
    rate: f64,
}

/// The groups of all taxels.
#[derive(Clone, Debug)]
pub(super) struct Common {
    /// The nearest first.
    groupings: Vec<Grouping>,
    /// Per channel, until when it has been told, s.
    told_until_s: Vec<f64>,
}

impl Common {
    /// Of groupings, the nearest first; each has one group a channel, or `None`.
    pub(super) fn new(groupings: Vec<Vec<Option<usize>>>) -> Self {
        let channels = groupings.first().map_or(0, Vec::len);
        let grouping = |group_of: Vec<Option<usize>>| {
            let groups = group_of.iter().flatten().max().map_or(0, |most| most + 1);
            Grouping { group_of, before: vec![None; channels], groups: vec![Group::default(); groups] }
        };
        let groupings = groupings.into_iter().map(grouping).collect();
        Self { groupings, told_until_s: vec![f64::NEG_INFINITY; channels] }
    }

    /// What each channel is told at `now_s` by the nearest of its groups that knows; `None` where none does. `levels` has
    /// those of untouched taxels; rates are means over `rate_s`.
    pub(super) fn tell(&mut self, levels: &[Option<f64>], now_s: f64, rate_s: f64) -> Vec<Option<Told>> {
        let mut told: Vec<Option<Told>> = vec![None; levels.len()];
        for grouping in &mut self.groupings {
            let said = grouping.hear(levels, now_s, rate_s);
            for (channel, told) in told.iter_mut().enumerate().filter(|(_, told)| told.is_none()) {
                let Some((since_s, all)) = grouping.group_of[channel].and_then(|group| said[group]) else { continue };
                // What another group has told of the time since is not told again.
                let new = ((now_s - self.told_until_s[channel]) / (now_s - since_s)).clamp(0.0, 1.0);
                *told = Some(Told { step: if new.is_nan() { 0.0 } else { all.step * new }, ..all });
            }
        }
        for (until_s, _) in self.told_until_s.iter_mut().zip(&told).filter(|(_, told)| told.is_some()) {
            *until_s = now_s;
        }
        told
    }
}

impl Grouping {
    /// What each group knows at `now_s`, and since when it has gone so far.
    fn hear(&mut self, levels: &[Option<f64>], now_s: f64, rate_s: f64) -> Vec<Option<(f64, Told)>> {
        let mut peers = vec![Vec::new(); self.groups.len()];
        let mut untouched = vec![0; self.groups.len()];
        for ((group, before), now) in self.group_of.iter().zip(&self.before).zip(levels) {
            if let (Some(group), Some(now)) = (*group, *now) {
                untouched[group] += 1;
                peers[group].extend(before.map(|before| [before, now]));
            }
        }
        // A group that was known by other taxels than it could be now begins anew; one of which too few are untouched waits
        // for them: what it drifts meanwhile, they know.
        for (before, (group, now)) in self.before.iter_mut().zip(self.group_of.iter().zip(levels)) {
            if group.is_some_and(|group| untouched[group] >= LEAST) {
                *before = *now;
            }
        }
        let mut said = Vec::with_capacity(peers.len());
        for ((group, peers), untouched) in self.groups.iter_mut().zip(&peers).zip(untouched) {
            let since_s = group.known_s;
            let step = step(peers);
            if let Some(step) = step.filter(|_| now_s > since_s) {
                let share = 1.0 - libm::exp(-(now_s - since_s) / rate_s);
                group.rate += share * (step / (now_s - since_s) - group.rate);
            }
            if untouched >= LEAST {
                group.known_s = now_s;
            }
            said.push(step.map(|step| (since_s, Told { step, rate: group.rate })));
        }
        said
    }
}

/// How far the median has gone; `None` where too few are heard.
fn step(peers: &[[f64; 2]]) -> Option<f64> {
    let median = |of: usize| {
        let mut levels: Vec<f64> = peers.iter().map(|peer| peer[of]).collect();
        levels.sort_by(f64::total_cmp);
        let middle = levels.len() / 2;
        if levels.len() % 2 == 1 { levels[middle] } else { 0.5 * (levels[middle - 1] + levels[middle]) }
    };
    (peers.len() >= LEAST).then(|| median(1) - median(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_group_that_knows_tells() {
        let boards = vec![Some(0), Some(0), Some(0), Some(1), Some(1), None];
        let mut common = Common::new(vec![boards, vec![Some(0); 6]]);
        assert_eq!(common.tell(&[0.0, 5.0, 3.0, 0.0, 0.0, 0.0].map(Some), 10.0, 1e-9), [None; 6]);
        // A liar does not move the median; it is one of levels, not of steps.
        let told = common.tell(&[Some(1.0), Some(6.0), Some(90.0), Some(3.0), Some(3.0), None], 12.0, 1e-9);
        assert_eq!(told, [Some(Told { step: 3.0, rate: 1.5 }); 6], "two are too few, so the body tells");
        assert_eq!(common.tell(&[None; 6], 14.0, 1e-9), [None; 6]);
    }

    #[test]
    fn what_drifts_while_nobody_is_untouched_is_told_later_and_once() {
        let mut common = Common::new(vec![vec![Some(0), Some(0), Some(0), None, None, None], vec![Some(0); 6]]);
        let tell = |common: &mut Common, board: bool, others: bool, level: f64, now_s: f64| {
            let levels: Vec<_> = (0..6).map(|of| (if of < 3 { board } else { others }).then_some(level)).collect();
            common.tell(&levels, now_s, 60.0)[0].map(|told| told.step)
        };
        assert_eq!(tell(&mut common, true, true, 0.0, 0.0), None);
        assert_eq!(tell(&mut common, true, true, 1.0, 1.0), Some(1.0));
        assert_eq!(tell(&mut common, false, false, 2.0, 2.0), None);
        assert_eq!(tell(&mut common, true, true, 3.0, 3.0), Some(2.0));
        // The others tell while the board is touched, and it does not tell that again.
        assert_eq!(tell(&mut common, false, true, 4.0, 4.0), Some(1.0));
        assert_eq!(tell(&mut common, true, true, 5.0, 5.0), Some(1.0));
    }

    #[test]
    fn whole_counts_add_up_to_the_drift() {
        // 1.4 counts a minute, seen in whole counts: most epochs have no step at all.
        let mut common = Common::new(vec![vec![Some(0); 9]]);
        let level = |taxel: usize, second: usize| (second as f64 * 1.4 / 60.0 + taxel as f64 / 9.0).floor();
        let mut sum = 0.0;
        for second in 0..1200 {
            let levels: Vec<_> = (0..9).map(|taxel| Some(level(taxel, second))).collect();
            sum += common.tell(&levels, second as f64, 15.0)[0].map_or(0.0, |told| told.step);
        }
        assert!((sum - 28.0_f64).abs() <= 1.0, "{sum}");
    }
}
