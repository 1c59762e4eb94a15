//! Methods that set one field each, for structs that may get more fields.

/// Gives a struct a method for each field named: `Options::default().batch(64)`.
#[macro_export]
#[doc(hidden)]
macro_rules! setters {
    ($name:ident { $($field:ident: $type:ty),+ $(,)? }) => {
        impl $name {
            $(
                #[doc = concat!("The same with this [`", stringify!($name), "::", stringify!($field), "`].")]
                #[must_use]
                pub fn $field(mut self, $field: $type) -> Self {
                    self.$field = $field.into();
                    self
                }
            )+
        }
    };
}
