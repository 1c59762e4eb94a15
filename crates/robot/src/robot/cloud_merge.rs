//! Clouds of several topics of a bag as frames of the whole body, by the rules for boards on lines. No I/O.
//!
//! Stamps replace times of arrival, so that one bag gives the same frames each time. A frame is made for each cloud of the
//! fastest topic that still sends, at its stamp, with the newest cloud of every other topic up to a short wait after it. A
//! cloud that is too old leaves its taxels stale, never zero.

use std::collections::VecDeque;

use crate::signal::{Frame, FrameTime, RawValue};
use crate::source::send_rate::{DEFAULT_PERIOD_S, leader, max_age_s, updated_period_s, wait_s};

/// How far a recorder may take clouds out of the order of their stamps, s.
const MAX_DISORDER_S: f64 = 0.5;
/// How many clouds wait for that order at most.
const MAX_WAITING: usize = 1024;

/// What a message tells of the taxels of a body.
pub(super) struct TopicCloud {
    pub(super) topic: usize,
    /// The time of its values.
    pub(super) time: FrameTime,
    /// When it came, by the recorder's clock, s.
    pub(super) log_s: f64,
    /// Indices in a frame, and the values there.
    pub(super) values: Vec<(usize, RawValue)>,
}

#[derive(Default)]
struct Topic {
    /// Clouds in the order in which they came, each with its place in that order over all topics.
    waiting: VecDeque<(u64, TopicCloud)>,
    /// The taxels of all its clouds.
    taxels: Vec<usize>,
    /// The newest cloud, and its time.
    values: Vec<(usize, RawValue)>,
    stamp: Option<FrameTime>,
    period_s: f64,
    /// Whether the newest cloud is in no frame yet.
    is_new: bool,
    account: TopicAccount,
}

/// How a topic did.
#[derive(Clone, Copy, Debug, Default)]
struct TopicAccount {
    /// Its clouds, and those of them that are in no frame.
    clouds: usize,
    replaced: usize,
    /// Frames without its values.
    absent: usize,
    /// Times of the first and the last cloud, s.
    span_s: Option<[f64; 2]>,
}

impl Topic {
    fn is_sending(&self, now: FrameTime) -> bool {
        self.stamp.is_some_and(|stamp| now.since(stamp) <= max_age_s(self.period_s, None))
    }

    /// Takes over `cloud` as its newest.
    fn take(&mut self, cloud: TopicCloud) {
        if let Some(before) = self.stamp {
            self.period_s = updated_period_s(self.period_s, cloud.time.since(before));
        }
        self.stamp = Some(cloud.time);
        self.values = cloud.values;
        self.account.clouds += 1;
        self.account.replaced += usize::from(std::mem::replace(&mut self.is_new, true));
        let [first_s, _] = self.account.span_s.unwrap_or([cloud.time.s; 2]);
        self.account.span_s = Some([first_s, cloud.time.s]);
    }
}

pub(super) struct CloudMerge {
    topics: Vec<Topic>,
    /// By taxel, the topic whose clouds have it.
    topic_of_taxel: Vec<Option<usize>>,
    /// How many clouds have come, and how many of them wait.
    came: u64,
    waiting: usize,
    /// When the newest came, s.
    newest_log_s: f64,
    has_ended: bool,
    /// The topic that sets the pace.
    leader: Option<usize>,
    /// The time of the frame that is being made.
    due: Option<FrameTime>,
    /// What is given for values that are too old, and whether any was so far.
    stale: RawValue,
    has_stale: bool,
    /// How many frames were made, and their first and last time, s.
    frames: usize,
    span_s: Option<[f64; 2]>,
}

impl CloudMerge {
    /// Of `topics` topics, for frames of `taxels` taxels.
    pub(super) fn new(topics: usize, taxels: usize) -> Self {
        let topic = || Topic { period_s: DEFAULT_PERIOD_S, ..Topic::default() };
        Self {
            topics: (0..topics).map(|_| topic()).collect(),
            topic_of_taxel: vec![None; taxels],
            came: 0,
            waiting: 0,
            newest_log_s: f64::NEG_INFINITY,
            has_ended: false,
            leader: None,
            due: None,
            stale: RawValue::MISSING,
            has_stale: false,
            frames: 0,
            span_s: None,
        }
    }

    /// From now on gives what is too old as [`RawValue::STALE`]; else it is missing.
    pub(super) fn report_stale(&mut self) {
        self.stale = RawValue::STALE;
    }

    pub(super) fn has_stale(&self) -> bool {
        self.has_stale
    }

    /// Takes the next cloud of the bag.
    ///
    /// # Errors
    /// The index of a taxel that another topic has, and that topic.
    pub(super) fn push(&mut self, cloud: TopicCloud) -> Result<(), (usize, usize)> {
        let topic = &mut self.topics[cloud.topic];
        for &(taxel, _) in &cloud.values {
            match *self.topic_of_taxel[taxel].get_or_insert_with(|| {
                topic.taxels.push(taxel);
                cloud.topic
            }) {
                own if own == cloud.topic => {}
                other => return Err((taxel, other)),
            }
        }
        self.newest_log_s = self.newest_log_s.max(cloud.log_s);
        topic.waiting.push_back((self.came, cloud));
        self.came += 1;
        self.waiting += 1;
        Ok(())
    }

    /// No cloud comes any more.
    pub(super) fn end(&mut self) {
        self.has_ended = true;
    }

    pub(super) fn has_ended(&self) -> bool {
        self.has_ended
    }

    /// Makes the next frame, if the clouds that have come suffice.
    pub(super) fn next_frame(&mut self, frame: &mut Frame) -> bool {
        loop {
            let head = self.head();
            let Some(due) = self.due.take_if(|due| match head {
                Some(topic) => Self::ends_frame(&self.topics, self.leader, *due, topic),
                None => self.has_ended,
            }) else {
                let Some(topic) = head else { return false };
                self.take(topic);
                continue;
            };
            self.fill(due, frame);
            return true;
        }
    }

    /// Of each topic with clouds that wait, the first of them, and its place in the order in which they came.
    fn heads(&self) -> impl Iterator<Item = (usize, u64, &TopicCloud)> {
        let topics = self.topics.iter().enumerate();
        topics.filter_map(|(topic, one)| one.waiting.front().map(|(came, cloud)| (topic, *came, cloud)))
    }

    /// The topic whose cloud is next by its stamp, if no earlier one is to come.
    fn head(&self) -> Option<usize> {
        let (least, ..) = self.heads().min_by(|a, b| a.2.time.total_cmp(&b.2.time).then(a.1.cmp(&b.1)))?;
        let (oldest, _, cloud) = self.heads().min_by_key(|(_, came, _)| *came)?;
        let waited_s = self.newest_log_s - cloud.log_s;
        // Stamps of two clocks never come into order.
        if waited_s > 2.0 * MAX_DISORDER_S || self.waiting > MAX_WAITING {
            return Some(oldest);
        }
        let is_sure = self.has_ended || waited_s > MAX_DISORDER_S || self.heads().count() == self.topics.len();
        is_sure.then_some(least)
    }

    /// Whether the next cloud of `topic` is not for the frame at `due`.
    fn ends_frame(topics: &[Topic], leader: Option<usize>, due: FrameTime, topic: usize) -> bool {
        let wait_s = leader.map_or(0.0, |leader| wait_s(topics[leader].period_s));
        let own = &topics[topic];
        let is_late = own.waiting.front().is_none_or(|(_, cloud)| cloud.time.since(due) > wait_s);
        // One that came since is not replaced.
        let is_second = own.is_new && own.stamp.is_some_and(|stamp| stamp.since(due) >= 0.0);
        is_late || leader == Some(topic) || is_second
    }

    fn take(&mut self, topic: usize) {
        let Some((_, cloud)) = self.topics[topic].waiting.pop_front() else { return };
        self.waiting -= 1;
        let time = cloud.time;
        self.topics[topic].take(cloud);
        let is_sending = |leader: usize| self.topics[leader].is_sending(time);
        let leads = leader(self.leader, topic, is_sending, |topic| self.topics[topic].period_s);
        self.leader = Some(leads);
        if leads == topic {
            self.due.get_or_insert(time);
        }
    }

    /// Fills `frame` with the values valid at `at`.
    fn fill(&mut self, at: FrameTime, frame: &mut Frame) {
        frame.values.resize(self.topic_of_taxel.len(), RawValue::MISSING);
        frame.clear();
        frame.set_time(at);
        let wait_s = self.leader.map_or(0.0, |leader| wait_s(self.topics[leader].period_s));
        for topic in &mut self.topics {
            let is_valid = topic.is_sending(at) && topic.stamp.is_some_and(|stamp| stamp.since(at) <= wait_s);
            let is_new = std::mem::take(&mut topic.is_new);
            if is_valid {
                topic.values.iter().for_each(|&(taxel, value)| frame.values[taxel] = value);
                continue;
            }
            topic.account.absent += 1;
            topic.account.replaced += usize::from(is_new);
            topic.taxels.iter().for_each(|&taxel| frame.values[taxel] = self.stale);
            self.has_stale |= !topic.taxels.is_empty();
        }
        self.frames += 1;
        let [first_s, _] = self.span_s.unwrap_or([at.s; 2]);
        self.span_s = Some([first_s, at.s]);
    }

    /// Topics whose clouds are not all in frames, or that not all frames have, with that in words; nothing the next time.
    pub(super) fn summaries(&mut self) -> Vec<(usize, String)> {
        let (frames, [first_s, last_s]) = (std::mem::take(&mut self.frames), self.span_s.unwrap_or_default());
        let mut all = Vec::new();
        for (index, topic) in self.topics.iter_mut().enumerate() {
            let TopicAccount { clouds, replaced, absent, span_s } = std::mem::take(&mut topic.account);
            let mut parts = Vec::new();
            if absent > 0 {
                let span = span_s.map_or("there are none".to_owned(), |[from_s, to_s]| {
                    format!("they are of {from_s} to {to_s} s, frames of {first_s} to {last_s} s")
                });
                parts.push(format!("{absent} of {frames} frames have no cloud of it that is young enough: {span}"));
            }
            if replaced > 0 {
                parts.push(format!("{replaced} of its {clouds} clouds are in no frame, as a newer one replaced them"));
            }
            if !parts.is_empty() {
                all.push((index, parts.join("; ")));
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times in ms, and the values.
    type Frames = Vec<(u32, Vec<Option<f64>>)>;

    /// The frames of clouds `(topic, stamp in ms, value)` of topics with a taxel each.
    fn merged(topics: usize, clouds: &[(usize, u32, f64)]) -> (Frames, CloudMerge) {
        let mut merge = CloudMerge::new(topics, topics);
        merge.report_stale();
        let mut found = Vec::new();
        let mut frame = Frame::default();
        let mut take = |merge: &mut CloudMerge| {
            while merge.next_frame(&mut frame) {
                let values = frame.values.iter().map(|value| value.number()).collect();
                found.push(((frame.t_s * 1e3).round() as u32, values));
            }
        };
        for &(topic, ms, value) in clouds {
            let t_s = f64::from(ms) * 1e-3;
            merge
                .push(TopicCloud { topic, time: t_s.into(), log_s: t_s, values: vec![(topic, RawValue::new(value))] })
                .unwrap();
            take(&mut merge);
        }
        merge.end();
        take(&mut merge);
        (found, merge)
    }

    #[test]
    fn clouds_of_one_stamp_are_one_frame_also_where_time_stands_still() {
        for first in [0, 1] {
            let second = 1 - first;
            let stamps = [0, 10, 10, 20, 500, 510];
            let clouds: Vec<(usize, u32, f64)> = (0..)
                .zip(stamps)
                .flat_map(|(at, ms)| [(first, ms, f64::from(at)), (second, ms, f64::from(at) + 0.5)])
                .collect();
            let (found, mut merge) = merged(2, &clouds);
            let expected: Vec<_> = (0..)
                .zip(stamps)
                .map(|(at, ms)| {
                    let own = |topic| Some(f64::from(at) + if topic == first { 0.0 } else { 0.5 });
                    (ms, vec![own(0), own(1)])
                })
                .collect();
            assert_eq!(found, expected);
            assert_eq!((merge.summaries(), merge.has_stale()), (Vec::new(), false));
        }
    }

    #[test]
    fn the_fastest_topic_sets_the_pace_and_others_hold_their_values() {
        let mut clouds: Vec<(usize, u32, f64)> = (0..100).map(|at| (0, 10 * at, f64::from(at))).collect();
        clouds.extend((0..25).map(|at| (1, 40 * at + 17, f64::from(at))));
        clouds.sort_by_key(|cloud| cloud.1);
        let (found, mut merge) = merged(2, &clouds);
        assert_eq!(found.len(), 100);
        for (at, (ms, values)) in found.iter().enumerate() {
            assert_eq!((*ms, values[0]), (10 * at as u32, Some(at as f64)));
            // A cloud 2.5 ms after a frame is still in it, one 7 ms after it is in the next.
            let newest = (at as i64 * 10 - 17).div_euclid(40);
            assert_eq!(values[1], (newest >= 0).then_some(newest as f64), "{at}");
        }
        let summaries = merge.summaries();
        assert!(summaries.len() == 1 && summaries[0].0 == 1, "{summaries:?}");
        assert!(
            summaries[0].1.starts_with("2 of 100 frames have no cloud of it that is young enough"),
            "{summaries:?}"
        );
        assert_eq!(merge.summaries(), []);
    }

    #[test]
    fn clouds_that_come_together_are_in_one_frame_whichever_comes_first() {
        let jitter = |at: u32| (at * 7919) % 5;
        let mut clouds = Vec::new();
        for at in 0..200 {
            clouds.push((0, 20 * at + 10, f64::from(at)));
            clouds.push((1, 20 * at + 8 + jitter(at), f64::from(at)));
        }
        clouds.sort_by_key(|cloud| cloud.1);
        let (found, _) = merged(2, &clouds);
        // Until its period is known, the second may lead.
        let together = found.iter().filter(|(_, values)| values[0] == values[1]).count();
        assert!(together >= 190 && found.len() <= 203, "{together} of {}", found.len());
    }

    #[test]
    fn a_topic_that_stops_is_stale_and_another_leads() {
        let mut clouds: Vec<(usize, u32, f64)> = (0..50).map(|at| (0, 10 * at, 1.0)).collect();
        clouds.extend((0..100).map(|at| (1, 10 * at + 5, 2.0)));
        clouds.sort_by_key(|cloud| cloud.1);
        let (found, mut merge) = merged(2, &clouds);
        let last_of_first = found.iter().rposition(|(_, values)| values[0].is_some()).unwrap();
        assert!((490..=550).contains(&found[last_of_first].0), "{:?}", found[last_of_first]);
        assert!(found[last_of_first + 1..].iter().all(|(_, values)| values == &[None, Some(2.0)]));
        assert_eq!(found.last().unwrap().0, 995);
        assert!(merge.has_stale());
        let summaries = merge.summaries();
        assert!(summaries[0].1.contains("they are of 0 to 0.49 s, frames of 0 to 0.995 s"), "{summaries:?}");
    }

    #[test]
    fn a_recorder_may_mix_up_topics_and_clocks_that_differ_end() {
        let mut clouds = Vec::new();
        for at in 0..50 {
            clouds.push((0, 20 * at, f64::from(at)));
            clouds.push((1, 20 * at, f64::from(at)));
        }
        let (expected, _) = merged(2, &clouds);
        // The second topic comes 80 ms later.
        let mut merge = CloudMerge::new(2, 2);
        let mut frame = Frame::default();
        let mut found = Vec::new();
        let mut late = clouds.clone();
        late.sort_by_key(|(topic, ms, _)| ms + 80 * *topic as u32);
        for (topic, ms, value) in late {
            let t_s = f64::from(ms) * 1e-3;
            let log_s = t_s + 0.08 * topic as f64;
            merge
                .push(TopicCloud { topic, time: t_s.into(), log_s, values: vec![(topic, RawValue::new(value))] })
                .unwrap();
            while merge.next_frame(&mut frame) {
                found.push((ms, frame.values.iter().map(|value| value.number()).collect::<Vec<_>>()));
            }
        }
        merge.end();
        while merge.next_frame(&mut frame) {
            found.push((0, frame.values.iter().map(|value| value.number()).collect()));
        }
        assert!(found.iter().map(|(_, values)| values).eq(expected.iter().map(|(_, values)| values)));

        let mut merge = CloudMerge::new(2, 2);
        let mut made = 0;
        for at in 0..10_000_u32 {
            let (topic, log_s) = ((at % 2) as usize, f64::from(at) * 0.005);
            let t_s = log_s + 1e9 * topic as f64;
            merge
                .push(TopicCloud { topic, time: t_s.into(), log_s, values: vec![(topic, RawValue::new(1.0))] })
                .unwrap();
            while merge.next_frame(&mut frame) {
                made += 1;
                assert!(frame.values[0].is_missing() || frame.values[1].is_missing());
            }
            assert!(merge.waiting < 300, "{}", merge.waiting);
        }
        assert!(made > 4000, "{made}");
    }

    #[test]
    fn a_taxel_has_one_topic() {
        let mut merge = CloudMerge::new(2, 3);
        let cloud = |topic, taxels: &[usize]| TopicCloud {
            topic,
            time: FrameTime::default(),
            log_s: 0.0,
            values: taxels.iter().map(|&taxel| (taxel, RawValue::new(1.0))).collect(),
        };
        assert_eq!(merge.push(cloud(0, &[0, 2])), Ok(()));
        assert_eq!(merge.push(cloud(1, &[1])), Ok(()));
        assert_eq!(merge.push(cloud(0, &[0])), Ok(()));
        assert_eq!(merge.push(cloud(1, &[1, 2])), Err((2, 0)));
    }
}
