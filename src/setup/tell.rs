//! Who is told what is found out.

use std::collections::BTreeSet;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

/// Who is told, a line at a time, what is found out of a source or a calibration; by default nobody.
#[derive(Clone, Default)]
pub struct Tell(Option<Arc<Told>>);

struct Told {
    to: Box<dyn Fn(&str) + Send + Sync>,
    /// What was told and is not to be told again.
    once: Mutex<BTreeSet<String>>,
}

impl Tell {
    /// Tells `to`.
    pub fn new(to: impl Fn(&str) + Send + Sync + 'static) -> Self {
        Self(Some(Arc::new(Told { to: Box::new(to), once: Mutex::default() })))
    }

    /// Tells `text`.
    pub fn say(&self, text: &str) {
        if let Some(told) = &self.0 {
            (told.to)(text);
        }
    }

    /// Tells `text` unless that was told before: a calibration may be needed several times.
    pub fn once(&self, text: &str) {
        if let Some(told) = &self.0
            && told.once.lock().unwrap_or_else(PoisonError::into_inner).insert(text.to_owned())
        {
            (told.to)(text);
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
