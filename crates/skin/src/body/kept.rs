//! What was worked out of a body's shape once, for all who ask for it again: engines of one body share its cells and surfaces, which
//! take most of the time that an engine takes to make.

use std::any::{Any, TypeId};
use std::collections::HashMap;
use std::fmt;
use std::hash::{BuildHasher as _, Hasher as _};
use std::sync::{Arc, Mutex, PoisonError};

use glam::{DAffine3, DVec3};

/// A body whose fields are changed again and again would keep the surfaces of all that it ever had: with so many values it begins anew.
const MOST_VALUES: usize = 4096;

type Values = HashMap<(TypeId, u64), Arc<dyn Any + Send + Sync>>;

/// What was worked out of a body, with the fingerprint of the shape that it was worked out of. Clones of a body share it.
#[derive(Clone, Default)]
pub struct Kept(Arc<Mutex<(u64, Values)>>);

impl fmt::Debug for Kept {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Kept")
    }
}

/// The values that are kept of a body as it is now.
#[derive(Debug)]
pub struct KeptOfShape<'a> {
    /// `None` for a body that is too large.
    pub(super) kept: Option<(&'a Kept, u64)>,
}

impl KeptOfShape<'_> {
    /// The value under `key`, or what `make` makes, which is kept. `make` must depend on the body's shape and on what `key` is a hash of,
    /// and on nothing else.
    pub fn get<T: Any + Send + Sync>(&self, key: u64, make: impl FnOnce() -> T) -> Arc<T> {
        let Some((kept, fingerprint)) = self.kept else { return Arc::new(make()) };
        let key = (TypeId::of::<T>(), key);
        // What fails elsewhere while it holds the lock leaves whole values behind.
        let lock = || kept.0.lock().unwrap_or_else(PoisonError::into_inner);
        {
            let (of, values) = &*lock();
            if *of == fingerprint
                && let Some(Ok(value)) = values.get(&key).cloned().map(Arc::downcast)
            {
                return value;
            }
        }
        let value = Arc::new(make());
        let mut now = lock();
        if now.0 != fingerprint || now.1.len() >= MOST_VALUES {
            *now = (fingerprint, Values::new());
        }
        now.1.insert(key, value.clone());
        value
    }
}

/// A hash of the bits of numbers, for keys of what is kept.
pub struct BitsHasher(foldhash::quality::FoldHasher<'static>);

impl fmt::Debug for BitsHasher {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("BitsHasher").field(&self.finish()).finish()
    }
}

impl Default for BitsHasher {
    fn default() -> Self {
        Self(foldhash::quality::FixedState::default().build_hasher())
    }
}

impl BitsHasher {
    /// Adds a whole number.
    pub fn number(&mut self, number: impl TryInto<u64>) {
        self.0.write_u64(number.try_into().unwrap_or(u64::MAX));
    }

    /// Adds the bits of floating-point numbers.
    pub fn numbers(&mut self, numbers: impl IntoIterator<Item = f64>) {
        numbers.into_iter().for_each(|number| self.0.write_u64(number.to_bits()));
    }

    /// Adds a vector.
    pub fn vector(&mut self, vector: DVec3) {
        self.numbers(vector.to_array());
    }

    /// Adds a transform.
    pub(super) fn affine(&mut self, affine: &DAffine3) {
        self.numbers(affine.to_cols_array());
    }

    /// The hash of all that was added.
    #[must_use]
    pub fn finish(&self) -> u64 {
        self.0.finish()
    }
}
