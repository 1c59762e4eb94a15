//! Reports what is found out about sources and calibrations.

use std::collections::BTreeSet;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

/// Receives, line by line, what is found out about a source or a calibration. The default drops the lines.
#[derive(Clone, Default)]
pub struct Tell(Option<Arc<Listener>>);

struct Listener {
    to: Box<dyn Fn(&str) + Send + Sync>,
    /// Lines that are not reported again.
    once: Mutex<BTreeSet<String>>,
}

impl Tell {
    /// Reports to `to`.
    pub fn new(to: impl Fn(&str) + Send + Sync + 'static) -> Self {
        Self(Some(Arc::new(Listener { to: Box::new(to), once: Mutex::default() })))
    }

    /// Reports `text`.
    pub fn say(&self, text: &str) {
        if let Some(listener) = &self.0 {
            (listener.to)(text);
        }
    }

    /// Reports `text` once only: a calibration may be needed several times.
    pub fn once(&self, text: &str) {
        if let Some(listener) = &self.0
            && listener.once.lock().unwrap_or_else(PoisonError::into_inner).insert(text.to_owned())
        {
            (listener.to)(text);
        }
    }
}

impl fmt::Debug for Tell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() { "Tell" } else { "Tell(nobody)" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_reported_once_is_not_reported_again() {
        let heard = Arc::new(Mutex::new(Vec::new()));
        let to = Arc::clone(&heard);
        let tell = Tell::new(move |text| to.lock().unwrap().push(text.to_owned()));
        tell.once("a");
        tell.clone().once("a");
        tell.say("a");
        tell.once("b");
        assert_eq!(*heard.lock().unwrap(), ["a", "a", "b"]);
        Tell::default().say("nobody hears it");
    }
}
