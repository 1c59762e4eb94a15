//! Recordings and bags that are damaged.

pub(crate) mod tests;
