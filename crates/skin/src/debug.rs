//! `Debug` for types that hold what has none, such as readers of any kind and memory of a device.

/// Gives types a `Debug` that says their names alone.
#[macro_export]
#[doc(hidden)]
macro_rules! debug_by_name {
    ($($name:ty),+ $(,)?) => {
        $(
            impl std::fmt::Debug for $name {
                fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                    f.debug_struct(stringify!($name)).finish_non_exhaustive()
                }
            }
        )+
    };
}
