//! Percepts copied from frame to frame.

use super::Percepts;
use super::batch::{Components, Values};
use super::columns::{Component, Host};

impl Percepts {
    /// Copies the percept of field `field` into frame `to`, from frame `from` of `source`, or of `self` if `source` is `None`.
    pub(crate) fn keep(&mut self, source: Option<&Self>, from: usize, to: usize, field: usize) {
        let fields = self.fields();
        let (from_cell, cell) = (from * fields + field, to * fields + field);
        macro_rules! keep {
            ($($column:ident),* $(,)?) => {
                $(if cell < self.$column.len() {
                    self.$column[cell] = source.map_or_else(|| self.$column[from_cell], |source| source.$column[from_cell]);
                })*
            };
        }
        keep!(in_world, flags, present, present_high, active);
        for &host in Host::ALL {
            let components = host.column().components;
            if self.has_host(host) {
                let mut kept = [0.0; 3];
                kept[..components].copy_from_slice(source.unwrap_or(self).host(host, from_cell));
                self.set_host(host, cell, &kept[..components]);
            }
        }
        match (&mut self.values, source.map(|source| &source.values)) {
            (Values::F32(columns), Some(Values::F32(source))) => columns.keep(Some(source), from_cell, cell),
            (Values::F64(columns), Some(Values::F64(source))) => columns.keep(Some(source), from_cell, cell),
            (Values::F64(columns), Some(Values::F32(source))) => columns.widen(source, from_cell, cell),
            (Values::F32(columns), _) => columns.keep(None, from_cell, cell),
            (Values::F64(columns), _) => columns.keep(None, from_cell, cell),
        }
    }

    /// Makes these percepts a single frame: a copy of frame `from` of `source`, which may be less precise.
    pub(crate) fn take_frame(&mut self, source: &Self, from: usize) {
        self.reset(1);
        for field in 0..self.fields() {
            self.keep(Some(source), from, 0, field);
        }
    }

    pub(crate) fn scale_speeds(&mut self, cell: usize, by: f64) {
        fn scale<T: Copy + Into<f64>>(parts: &mut Components<T>, cell: usize, scaled: impl Fn(f64) -> T) {
            for part in [Component::Speed, Component::RadialSpeed] {
                if let Some(speed) = parts[part].get_mut(cell) {
                    *speed = scaled((*speed).into());
                }
            }
        }
        match &mut self.values {
            Values::F32(parts) => scale(parts, cell, |speed| (speed * by) as f32),
            Values::F64(parts) => scale(parts, cell, |speed| speed * by),
        }
    }
}

impl Components<f64> {
    fn widen(&mut self, source: &Components<f32>, from: usize, to: usize) {
        for &part in Component::ALL {
            if to < self[part].len() {
                self[part][to] = source[part][from].into();
            }
        }
    }
}

impl<T: Copy> Components<T> {
    fn keep(&mut self, source: Option<&Self>, from: usize, to: usize) {
        for &part in Component::ALL {
            if to < self[part].len() {
                self[part][to] = source.unwrap_or(self)[part][from];
            }
        }
    }
}
