//! What follows from how often something sends: how long its values hold, and whose frames set the pace. One rule for boards on
//! lines, limbs on a network and topics of a bag.

/// Default maximum age of a value, periods of what sends it.
const MAX_AGE_PERIODS: f64 = 3.0;
/// Minimum of the maximum age, since USB adapters and schedulers delay frames, s.
const MIN_MAX_AGE_S: f64 = 0.05;
/// The assumed period before it is measured, s.
pub const DEFAULT_PERIOD_S: f64 = 0.1;
/// What sends takes over the pace if its period is below this share of the leader's.
pub(crate) const TAKEOVER_SHARE: f64 = 0.8;
/// A step of this many periods is a pause, not a period.
const PAUSE_PERIODS: f64 = 8.0;
/// Share of a new step in the measured period.
const STEP_SHARE: f64 = 0.1;

/// A merged frame waits for others that are about to send, at most this long, s, and this share of the period. Otherwise what
/// sends at the same time would sometimes miss a frame and lose it to its next one.
pub(crate) const MAX_WAIT_S: f64 = 0.005;
const MAX_WAIT_PERIODS: f64 = 0.25;

/// How old a value may be, s, where its sender's period is `period_s`, unless `asked` says it.
pub fn max_age_s(period_s: f64, asked: Option<f64>) -> f64 {
    asked.unwrap_or((MAX_AGE_PERIODS * period_s).max(MIN_MAX_AGE_S))
}

/// How long a merged frame waits, s, where the period is `period_s`.
pub fn wait_s(period_s: f64) -> f64 {
    (MAX_WAIT_PERIODS * period_s).min(MAX_WAIT_S)
}

/// The period after `period_s`, now that `step_s` lie between two frames.
pub fn updated_period_s(period_s: f64, step_s: f64) -> f64 {
    let is_period = step_s > 0.0 && step_s < PAUSE_PERIODS * period_s;
    if is_period { period_s + STEP_SHARE * (step_s - period_s) } else { period_s }
}

/// Which of several senders sets the pace after a frame of `sender`: the `leader` as long as it sends, unless `sender` is clearly faster.
pub fn leader(
    leader: Option<usize>,
    sender: usize,
    is_sending: impl Fn(usize) -> bool,
    period_s: impl Fn(usize) -> f64,
) -> usize {
    match leader {
        Some(leader) if is_sending(leader) && period_s(sender) >= TAKEOVER_SHARE * period_s(leader) => leader,
        _ => sender,
    }
}
