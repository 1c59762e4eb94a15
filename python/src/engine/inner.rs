//! The library's engine, the batches that are lent to Python, and the page that shows it.

use std::sync::Arc;
use std::time::Instant;

use somatic::internal::signal::FrameBlock;
use somatic::{Engine, Percepts};

use crate::view::Page;

/// Batches that may be lent to Python and wait for their memory to come back.
const LENT: usize = 4;

pub(super) struct Inner {
    pub(super) engine: Engine,
    /// Batches that were given to Python, whose memory is used again when nobody needs them.
    pub(super) lent: Vec<Arc<Percepts>>,
    /// What shows them in a browser.
    pub(super) page: Option<Arc<Page>>,
}

impl Inner {
    /// The percepts of the last call, to keep, and what the engine has to say: a GPU that was lost.
    pub(super) fn take(&mut self) -> (Arc<Percepts>, Option<String>) {
        let free = self.lent.iter().position(|lent| Arc::strong_count(lent) == 1);
        let spare = free.and_then(|free| Arc::into_inner(self.lent.swap_remove(free)));
        let percepts = Arc::new(self.engine.take_percepts(spare));
        if self.lent.len() == LENT {
            self.lent.remove(0);
        }
        self.lent.push(Arc::clone(&percepts));
        (percepts, self.engine.notice())
    }

    /// Shows the last frame of a call that began at `began`, where somebody looks.
    pub(super) fn show(&self, block: &FrameBlock<'_>, began: Instant) {
        if let Some(page) = &self.page {
            page.show(&self.engine, block, began);
        }
    }
}
