//! What is known of one limb: its layout, the numbers of what it has sent, and its clock. No I/O, no clock of its own.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::super::boards::{BoardFrame, BoardState, Clock, LimbPercepts, Shared, Verdict};
use crate::error::Error;
use crate::limb::{Packet, open, qualified, raw_value};
use crate::signal::Channel;
use crate::wire::{FrameCounts, Head, PacketOrder};

/// A limb that sends nothing for this long is silent.
const SILENT_AFTER: Duration = Duration::from_secs(1);

/// Which limb has which taxel of the body, so that none has another's.
pub(super) struct Taxels {
    /// By id, the index in a frame's values.
    places: HashMap<u32, usize>,
    owners: Mutex<Vec<Option<usize>>>,
}

impl Taxels {
    /// Of a body whose taxels have `ids`.
    pub(super) fn new(ids: &[u32]) -> Self {
        let places = ids.iter().enumerate().map(|(place, id)| (*id, place)).collect();
        Self { places, owners: Mutex::new(vec![None; ids.len()]) }
    }

    /// Makes `taxels` those of `limb`: where each is in a frame's values, or why they are not its own.
    fn claim(&self, limb: usize, taxels: &[u32]) -> Result<Arc<[Option<usize>]>, String> {
        let place = |id: &u32| {
            let place = self.places.get(id).copied();
            place
                .ok_or_else(|| format!("the body has no taxel {}, which it sends; is it the right body?", Channel(*id)))
        };
        let places = taxels.iter().map(place).collect::<Result<Vec<_>, _>>()?;
        let mut owners = self.owners.lock().unwrap_or_else(PoisonError::into_inner);
        let taken = places.iter().zip(taxels).find(|(place, _)| owners[**place].is_some_and(|owner| owner != limb));
        if let Some((_, id)) = taken {
            return Err(format!("another limb sends taxel {} too; let each limb send its own", Channel(*id)));
        }
        owners.iter_mut().filter(|owner| **owner == Some(limb)).for_each(|owner| *owner = None);
        places.iter().for_each(|&place| owners[place] = Some(limb));
        Ok(places.into_iter().map(Some).collect())
    }
}

/// The layout that a limb's frames are in.
struct Layout {
    hash: u32,
    places: Arc<[Option<usize>]>,
}

pub(super) struct Limb {
    /// Its index among the limbs.
    index: usize,
    key: String,
    shared: Arc<Shared>,
    taxels: Arc<Taxels>,
    counts: FrameCounts,
    layout: Option<Layout>,
    /// Whether its numbers are counted: from its first layout or percepts on.
    is_counted: bool,
    /// Frames lost since the last that was delivered.
    lost: u32,
    has_restarted: bool,
    /// For percepts, whose times are computed here.
    clock: Clock,
    /// When something came last.
    heard: Option<Duration>,
    is_silent: bool,
    has_ended: bool,
    /// The last message about something that cannot be used.
    said: Option<String>,
}

impl Limb {
    pub(super) fn new(index: usize, key: &str, shared: Arc<Shared>, taxels: Arc<Taxels>) -> Self {
        Self {
            index,
            key: key.to_owned(),
            shared,
            taxels,
            counts: FrameCounts::default(),
            layout: None,
            is_counted: false,
            lost: 0,
            has_restarted: false,
            clock: Clock::of_limb(),
            heard: None,
            is_silent: false,
            has_ended: false,
            said: None,
        }
    }

    /// Takes what came under its key at `read_at`, which is `now`.
    pub(super) fn receive(&mut self, bytes: &[u8], now: Duration, read_at: Instant) {
        let (head, packet) = match open(bytes) {
            Ok(opened) => opened,
            Err(why) => {
                self.shared.lock().accounts[self.index].corrupt += 1;
                return self.bad(why);
            }
        };
        if !self.is_counted && !matches!(packet, Packet::Layout { .. } | Packet::Percepts(_)) {
            // Nobody knows yet what it sends: its count begins with its layout.
            return;
        }
        self.is_counted = true;
        let is_frame = matches!(packet, Packet::Frame { .. } | Packet::Percepts(_));
        let order = self.counts.count(&head, is_frame);
        self.see(&order, now);
        match packet {
            Packet::Layout { taxels } => self.lay_out(&taxels),
            Packet::Frame { layout, values } => self.frame(layout, values, &order, now, read_at),
            Packet::Percepts(percepts) => match qualified(&self.key, &percepts) {
                Ok(rest) => self.percepts(&rest, &order, now, read_at),
                Err(why) => {
                    // They are not used: they count as lost.
                    self.lost += 1;
                    self.shared.lock().accounts[self.index].lost += 1;
                    self.bad(why);
                }
            },
            Packet::End => self.end(&head),
        }
    }

    /// Counts what the numbers say is missing, and notices a new start.
    fn see(&mut self, order: &PacketOrder, now: Duration) {
        self.heard = Some(now);
        let mut state = self.shared.lock();
        let account = &mut state.accounts[self.index];
        account.port.get_or_insert_with(|| self.key.clone());
        account.lost += u64::from(order.lost);
        account.restarts += u64::from(order.restarted);
        self.lost += order.lost;
        if order.restarted {
            state.notify(format!("zenoh:{}: the limb has started again", self.key));
            self.clock.restart();
            (self.has_restarted, self.layout) = (true, None);
        } else if std::mem::take(&mut self.is_silent) {
            state.notify(format!("zenoh:{}: the limb sends again", self.key));
        }
        self.is_silent = false;
        self.has_ended = false;
    }

    fn lay_out(&mut self, taxels: &[u32]) {
        let hash = crate::limb::hash(taxels);
        if self.layout.as_ref().is_some_and(|layout| layout.hash == hash) {
            return;
        }
        match self.taxels.claim(self.index, taxels) {
            Ok(places) => {
                self.layout = Some(Layout { hash, places });
                self.said = None;
                self.shared.lock().set_verdict(self.index, Verdict::Good);
            }
            Err(why) => {
                self.layout = None;
                self.bad(why);
            }
        }
    }

    fn frame(&mut self, layout: u32, values: &[u8], order: &PacketOrder, now: Duration, read_at: Instant) {
        let known = self.layout.as_ref().filter(|known| known.hash == layout && 4 * known.places.len() == values.len());
        let Some(known) = known else {
            // A frame that is not used counts as lost.
            self.lost += 1;
            self.shared.lock().accounts[self.index].lost += 1;
            return;
        };
        let values = values.chunks_exact(4).map(|bytes| raw_value([bytes[0], bytes[1], bytes[2], bytes[3]]));
        let values = (0..).zip(values).filter(|(_, value)| *value != crate::signal::RawValue::MISSING).collect();
        let frame = BoardFrame {
            board: self.index,
            board_us: order.time_us,
            arrived_s: now.as_secs_f64(),
            lost: std::mem::take(&mut self.lost),
            restarted: std::mem::take(&mut self.has_restarted),
            partial: false,
            places: Some(Arc::clone(&known.places)),
            values,
        };
        self.shared.deliver(frame, read_at);
    }

    /// Passes percepts on; `rest` is their line behind the time.
    fn percepts(&mut self, rest: &str, order: &PacketOrder, now: Duration, read_at: Instant) {
        let t_s = self.clock.host_time_s(order.time_us, now.as_secs_f64());
        let line = format!("{{\"limb\":{},\"t\":{t_s}{rest}", serde_json::Value::from(self.key.as_str()));
        let mut state = self.shared.lock();
        state.set_verdict(self.index, Verdict::Good);
        if state.accounts[self.index].delivered == 0 {
            state.notify(format!("zenoh:{}: it sends percepts, which go to sinks of NDJSON alone", self.key));
        }
        drop(state);
        (self.lost, self.has_restarted) = (0, false);
        self.shared.deliver_percepts(LimbPercepts { line, read_at, limb: self.index });
    }

    fn end(&mut self, head: &Head) {
        self.has_ended = true;
        let mut state = self.shared.lock();
        state.accounts[self.index].state = BoardState::Silent;
        state.notify(format!("zenoh:{}: the limb has ended after {} frames", self.key, head.sequence));
    }

    /// Notices at `now` that nothing has come for long.
    pub(super) fn watch(&mut self, now: Duration) {
        let is_silent = self.heard.is_some_and(|heard| now > heard + SILENT_AFTER);
        if is_silent && !self.is_silent && !self.has_ended {
            self.is_silent = true;
            let mut state = self.shared.lock();
            state.accounts[self.index].state = BoardState::Silent;
            state.notify(format!("zenoh:{}: the limb sends nothing", self.key));
        }
    }

    fn bad(&mut self, why: String) {
        if self.said.as_ref() != Some(&why) {
            let error = Error::failed(why.clone()).at(format!("zenoh:{}", self.key));
            self.shared.lock().set_verdict(self.index, Verdict::Bad(error));
            self.shared.arrived.notify_all();
            self.said = Some(why);
        }
    }
}
