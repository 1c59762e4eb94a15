//! Quantities as their components and back.

/// The type of a percept's quantity, made of its components.
pub(super) trait Typed {
    fn from_components(components: [f64; 3]) -> Self;
    fn components(self) -> [f64; 3];
}

impl Typed for f64 {
    fn from_components([value, ..]: [f64; 3]) -> Self {
        value
    }

    fn components(self) -> [f64; 3] {
        [self, 0.0, 0.0]
    }
}

impl Typed for u32 {
    fn from_components([value, ..]: [f64; 3]) -> Self {
        value as Self
    }

    fn components(self) -> [f64; 3] {
        [self.into(), 0.0, 0.0]
    }
}

/// Two or three.
impl<const N: usize> Typed for [f64; N] {
    fn from_components(components: [f64; 3]) -> Self {
        std::array::from_fn(|index| components[index])
    }

    fn components(self) -> [f64; 3] {
        std::array::from_fn(|index| self.get(index).copied().unwrap_or(0.0))
    }
}
