//! Percepts that stay what they were.

use super::batch::{Columns, Values};
use super::{Percepts, Touch};

impl Percepts {
    /// Makes the percept of field `field` in frame `to` that of frame `from` of `of`, or of these where that is `None`; but for
    /// the separate touches.
    pub(crate) fn keep(&mut self, of: Option<&Self>, from: usize, to: usize, field: usize) {
        let fields = self.fields();
        let (from_cell, cell) = (from * fields + field, to * fields + field);
        macro_rules! keep {
            ($($column:ident),* $(,)?) => {
                $(if cell < self.$column.len() {
                    self.$column[cell] = of.map_or_else(|| self.$column[from_cell], |of| of.$column[from_cell]);
                })*
            };
        }
        keep!(
            in_world,
            flags,
            present,
            active,
            position,
            normal,
            filtered_displacement,
            filtered_direction,
            filtered_speed
        );
        match (&mut self.values, of.map(|of| &of.values)) {
            (Values::F32(columns), Some(Values::F32(of))) => columns.keep(Some(of), from_cell, cell),
            (Values::F64(columns), Some(Values::F64(of))) => columns.keep(Some(of), from_cell, cell),
            (Values::F32(columns), _) => columns.keep(None, from_cell, cell),
            (Values::F64(columns), _) => columns.keep(None, from_cell, cell),
        }
    }

    /// Makes the percept of field `field`, the next, in the first frame that of frame `from` of `of`.
    pub(crate) fn take_over(&mut self, of: &Self, from: usize, field: usize) {
        self.keep(Some(of), from, 0, field);
        self.push_touches(of.touches(from, field).iter().copied());
    }

    /// The separate touches of field `field` in frame `from` of `of`, or of these.
    pub(crate) fn kept_touches(&self, of: Option<&Self>, from: usize, field: usize) -> Vec<Touch> {
        of.unwrap_or(self).touches(from, field).to_vec()
    }

    /// Multiplies a cell's speeds.
    pub(crate) fn scale_speeds(&mut self, cell: usize, by: f64) {
        match &mut self.values {
            Values::F32(columns) => {
                for column in [&mut columns.speed, &mut columns.radial_speed] {
                    if let Some(speed) = column.get_mut(cell) {
                        *speed = (f64::from(*speed) * by) as f32;
                    }
                }
            }
            Values::F64(columns) => {
                for column in [&mut columns.speed, &mut columns.radial_speed] {
                    if let Some(speed) = column.get_mut(cell) {
                        *speed *= by;
                    }
                }
            }
        }
    }
}

impl<T: Copy> Columns<T> {
    fn keep(&mut self, of: Option<&Self>, from: usize, to: usize) {
        macro_rules! keep {
            ($($column:ident),* $(,)?) => {
                $(if to < self.$column.len() {
                    self.$column[to] = of.map_or_else(|| self.$column[from], |of| of.$column[from]);
                })*
            };
        }
        keep!(
            total,
            peak,
            area,
            centroid_u,
            centroid_v,
            centroid_depth,
            orientation,
            axis,
            anisotropy,
            displacement,
            direction,
            distance,
            radial_distance,
            speed,
            radial_speed,
        );
    }
}
