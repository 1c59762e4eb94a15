//! Limbs on computers of their own, many at once, as one source of frames.
//!
//! Their frames are merged as those of boards on serial lines are: by clock and age, missing is missing. Percepts that limbs
//! have computed pass by the engine ([`super::Lines::percepts`]). `docs/reference/limbs.md` explains the messages.

mod limb;

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use self::limb::{Limb, Taxels};
use super::Source;
use super::boards::{BoardAccount, Lines, Merge, Merged, Pace, Shared};
use crate::error::{Error, Result, failed};
use crate::limb::{Network, Side};
use crate::signal::Frame;

/// How often silent limbs are looked for.
const WATCH_PERIOD: Duration = Duration::from_millis(100);

/// How limbs are read.
#[derive(Clone, Debug, Default)]
pub struct LimbOptions {
    /// Zenoh's own configuration, JSON5. Without one, limbs on this computer are heard, on port 7447.
    pub zenoh_config: Option<PathBuf>,
    /// Rate of merged frames, Hz; 0 for one at each frame of any limb. By default one at each frame of the fastest limb.
    pub live_rate_hz: Option<f64>,
    /// Maximum age of a value, s; by default three periods of its limb, at least 50 ms.
    pub max_age_s: Option<f64>,
}

/// Frames of limbs on a network.
///
/// Times count from its opening, s. Values of a silent limb are [`RawValue::STALE`](somatic_skin::signal::RawValue::STALE); those of taxels
/// that no limb has sent yet are missing.
pub struct LimbSource {
    merged: Merged,
    taxels: Vec<u32>,
}

impl LimbSource {
    /// Starts to hear the limbs that send under `keys`, for a body whose taxels have `ids`.
    ///
    /// It returns at once; [`Lines::notices`] tells how limbs are doing.
    ///
    /// # Errors
    /// A key is named twice, a rate makes no sense, or the session with the network cannot be opened.
    pub fn open(keys: &[String], ids: &[u32], options: &LimbOptions) -> Result<Self> {
        if let Some((_, key)) = keys.iter().enumerate().find(|(index, key)| keys[..*index].contains(key)) {
            return Err(Error::usage("this limb is given twice; give each once").at(format!("zenoh:{key}")));
        }
        let pace = Pace::from_rate(options.live_rate_hz)?;
        let network = Network::open(options.zenoh_config.as_deref(), Side::Head)?;
        let start = Instant::now();
        let account = |(index, key): (u16, &String)| BoardAccount {
            board: index,
            limb: Some(key.clone()),
            ..BoardAccount::default()
        };
        let accounts = (1..).zip(keys).map(account).collect();
        let no_wipers = vec![Vec::new(); keys.len()];
        let shared = Arc::new(Shared::new(accounts, no_wipers, keys.len(), start).with_readers(1));
        let taxels = Arc::new(Taxels::new(ids));
        let mut limbs = Vec::new();
        for (index, key) in keys.iter().enumerate() {
            let limb = Arc::new(Mutex::new(Limb::new(index, key, Arc::clone(&shared), Arc::clone(&taxels))));
            limbs.push(Arc::clone(&limb));
            network.subscribe(key, move |bytes| {
                let read_at = Instant::now();
                limb.lock().unwrap_or_else(PoisonError::into_inner).receive(bytes, read_at - start, read_at);
            })?;
        }
        let watched = Arc::clone(&shared);
        thread::Builder::new()
            .name("limbs".to_owned())
            .spawn(move || watch(network, &limbs, &watched, start))
            .map_err(|e| failed!("cannot start a thread: {e}"))?;
        let places = vec![Vec::new(); keys.len()];
        let merge = Merge::new(places, pace, options.max_age_s).of_limbs();
        let merged = Merged::new(shared, merge, ids.len(), start);
        Ok(Self { merged, taxels: ids.to_vec() })
    }

    /// State and messages of the limbs, for display.
    #[must_use]
    pub fn lines(&self) -> Lines {
        self.merged.lines.clone()
    }
}

/// Looks for silent limbs until the lines are closed; then ends the session.
fn watch(network: Network, limbs: &[Arc<Mutex<Limb>>], shared: &Shared, start: Instant) {
    while !shared.lock().closed {
        let lock = |limb: &Arc<Mutex<Limb>>| limb.lock().unwrap_or_else(PoisonError::into_inner).watch(start.elapsed());
        limbs.iter().for_each(lock);
        let state = shared.lock();
        if !state.closed {
            drop(shared.closing.wait_timeout(state, WATCH_PERIOD));
        }
    }
    shared.lock().readers -= 1;
    shared.arrived.notify_all();
    drop(network);
}

impl Source for LimbSource {
    fn taxels(&self) -> &[u32] {
        &self.taxels
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        self.merged.next_frame(frame)
    }

    fn read_at(&mut self) -> Option<Instant> {
        self.merged.read_at()
    }

    fn losses(&self) -> Vec<String> {
        self.merged.lines.losses()
    }
}
