//! What the parts of a view have in common.

use std::sync::Arc;

use somatic::internal::page::Replies;
use somatic::{Body, Engine, Options, Result};

use super::checkpoints::Checkpoints;
use super::peaks::Peaks;
use super::recorded::Differences;
use super::recording::Recording;

/// What the player, the pass behind it and the explainer share.
#[derive(Clone)]
pub(super) struct Shared {
    pub(super) body: Arc<Body>,
    pub(super) options: Options,
    pub(super) recording: Arc<Recording>,
    pub(super) checkpoints: Arc<Checkpoints>,
    /// What the recording holds of percepts that differ from those computed now.
    pub(super) differences: Arc<Differences>,
    /// The highest pressures in parts of the recording.
    pub(super) peaks: Arc<Peaks>,
    pub(super) replies: Replies,
}

impl Shared {
    /// An engine of its own for one of them.
    pub(super) fn engine(&self) -> Result<Engine> {
        let mut engine = Engine::new(&self.body, self.options.clone())?;
        engine.keep_touch_taxels(true);
        engine.set_channels(&self.recording.taxels)?;
        Ok(engine)
    }
}
