//! Calls what may panic on a damaged file.
//!
//! `mesh-loader` indexes a COLLADA file's lists without looking whether the index is there.

use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;
use std::thread::{Builder, current, scope};

/// The name of the thread that calls, by which its panics are known.
const NAME: &str = "guarded";

/// What `call` gives; `None` if it panics, of which nothing is printed.
pub(super) fn call<T: Send>(call: impl FnOnce() -> T + Send) -> Option<T> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let before = take_hook();
        set_hook(Box::new(move |panic| {
            if current().name() != Some(NAME) {
                before(panic);
            }
        }));
    });
    scope(|scope| {
        let guarded = || catch_unwind(AssertUnwindSafe(call)).ok();
        let thread = Builder::new().name(NAME.to_owned()).spawn_scoped(scope, guarded).ok()?;
        thread.join().ok().flatten()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_nothing() {
        assert_eq!(call(|| 7), Some(7));
        let nothing: [u8; 0] = [];
        assert_eq!(call(|| nothing[std::hint::black_box(3)]), None);
    }
}
