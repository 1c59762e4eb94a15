//! A batch of percepts, in columns.

use super::{Flags, Outputs, Percept, Precision, Touch};

/// One precision's columns, a value per cell; a cell is `frame · fields + field`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Columns<T> {
    pub(crate) total: Vec<T>,
    pub(crate) peak: Vec<T>,
    pub(crate) area: Vec<T>,
    /// (u, v, depth) in the chart; of a field without one, along its anchor's axes from the field's origin.
    pub(crate) centroid_u: Vec<T>,
    pub(crate) centroid_v: Vec<T>,
    /// Kept only where positions are wanted.
    pub(crate) centroid_depth: Vec<T>,
    pub(crate) orientation: Vec<T>,
    pub(crate) axis: Vec<T>,
    pub(crate) anisotropy: Vec<T>,
    pub(crate) displacement: Vec<[T; 2]>,
    pub(crate) direction: Vec<T>,
    pub(crate) distance: Vec<T>,
    pub(crate) radial_distance: Vec<T>,
    pub(crate) speed: Vec<T>,
    pub(crate) radial_speed: Vec<T>,
}

impl<T: Clone + Default> Columns<T> {
    /// Makes room for `cells` cells of each wanted column, which keep what they held: backends write every cell.
    fn resize(&mut self, wanted: Outputs, cells: usize) {
        let fit = |column: &mut Vec<T>, output| {
            column.resize(if wanted.intersects(output) { cells } else { 0 }, T::default());
        };
        // Motion is made from the centroids' columns.
        let place = Outputs::CENTROID | Outputs::POSITION | Outputs::NORMAL | Outputs::MOTION;
        fit(&mut self.total, Outputs::TOTAL);
        fit(&mut self.peak, Outputs::PEAK);
        fit(&mut self.area, Outputs::AREA);
        fit(&mut self.centroid_u, place);
        fit(&mut self.centroid_v, place);
        fit(&mut self.centroid_depth, Outputs::POSITION | Outputs::NORMAL);
        fit(&mut self.orientation, Outputs::ORIENTATION);
        fit(&mut self.axis, Outputs::AXIS);
        fit(&mut self.anisotropy, Outputs::ANISOTROPY);
        self.displacement.resize(if wanted.contains(Outputs::DISPLACEMENT) { cells } else { 0 }, Default::default());
        fit(&mut self.direction, Outputs::DIRECTION);
        fit(&mut self.distance, Outputs::DISTANCE);
        fit(&mut self.radial_distance, Outputs::RADIAL_DISTANCE);
        fit(&mut self.speed, Outputs::SPEED);
        fit(&mut self.radial_speed, Outputs::RADIAL_SPEED);
    }
}

/// The columns in the precision of the backend that made them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Values {
    F32(Columns<f32>),
    F64(Columns<f64>),
}

/// The percepts of a batch: `frames × fields` cells, only the outputs that were asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Percepts {
    outputs: Outputs,
    /// The outputs, and what stages work on.
    columns: Outputs,
    pub(super) fields: usize,
    /// Letters that every field is there in, one after the other.
    letters: usize,
    /// Taxels whose pressures are kept, 0 unless a stage works on them.
    pub(super) slots: usize,
    pub(crate) first_frame: u64,
    pub(crate) t_s: Vec<f64>,
    pub(crate) in_world: Vec<bool>,
    pub(crate) flags: Vec<Flags>,
    pub(crate) present: Vec<Outputs>,
    pub(crate) active: Vec<u32>,
    pub(crate) values: Values,
    pub(crate) position: Vec<[f64; 3]>,
    pub(crate) normal: Vec<[f64; 3]>,
    pub(crate) filtered_displacement: Vec<[f64; 2]>,
    pub(crate) filtered_direction: Vec<f64>,
    pub(crate) filtered_speed: Vec<f64>,
    /// P, frame by frame, each taxel by taxel.
    pub(crate) pressures: Vec<f64>,
    touches: Vec<Touch>,
    /// Per cell, the end of its touches.
    touch_ends: Vec<u32>,
}

impl Percepts {
    /// An empty batch for `fields` fields that holds `outputs`.
    #[must_use]
    pub fn new(outputs: Outputs, fields: usize, precision: Precision) -> Self {
        Self {
            outputs,
            columns: outputs,
            fields,
            letters: 1,
            slots: 0,
            first_frame: 0,
            t_s: Vec::new(),
            in_world: Vec::new(),
            flags: Vec::new(),
            present: Vec::new(),
            active: Vec::new(),
            values: match precision {
                Precision::F32 => Values::F32(Columns::default()),
                Precision::F64 => Values::F64(Columns::default()),
            },
            position: Vec::new(),
            normal: Vec::new(),
            filtered_displacement: Vec::new(),
            filtered_direction: Vec::new(),
            filtered_speed: Vec::new(),
            pressures: Vec::new(),
            touches: Vec::new(),
            touch_ends: Vec::new(),
        }
    }

    /// The same, for fields of which each stands there in `letters` letters, one after the other.
    pub(crate) fn with_letters(mut self, letters: usize) -> Self {
        self.letters = letters.max(1);
        self
    }

    /// The same, with room for `columns` beside the outputs, and for the pressures of `slots` taxels.
    pub(crate) fn with_columns(mut self, columns: Outputs, slots: usize) -> Self {
        self.columns |= columns;
        self.slots = slots;
        self
    }

    /// Makes room for `frames` frames, every cell empty. Allocates only when a batch is larger than all before it.
    pub(crate) fn reset(&mut self, frames: usize) {
        fn refill<V: Clone>(column: &mut Vec<V>, length: usize, value: V) {
            column.clear();
            column.resize(length, value);
        }
        let cells = frames * self.fields;
        let when = |output, cells| if self.outputs.contains(output) { cells } else { 0 };
        refill(&mut self.t_s, frames, 0.0);
        self.in_world.resize(cells, false);
        self.flags.resize(cells, Flags::empty());
        self.present.resize(cells, Outputs::empty());
        self.active.resize(if self.columns.contains(Outputs::ACTIVE) { cells } else { 0 }, 0);
        self.position.resize(when(Outputs::POSITION, cells), [0.0; 3]);
        self.normal.resize(when(Outputs::NORMAL, cells), [0.0; 3]);
        refill(&mut self.filtered_displacement, when(Outputs::FILTERED_DISPLACEMENT, cells), [0.0; 2]);
        refill(&mut self.filtered_direction, when(Outputs::FILTERED_DIRECTION, cells), 0.0);
        refill(&mut self.filtered_speed, when(Outputs::FILTERED_SPEED, cells), 0.0);
        refill(&mut self.pressures, frames * self.slots, 0.0);
        self.touches.clear();
        self.touch_ends.clear();
        match &mut self.values {
            Values::F32(columns) => columns.resize(self.columns, cells),
            Values::F64(columns) => {
                // The reference leaves what is absent as it is.
                columns.resize(self.columns, 0);
                columns.resize(self.columns, cells);
            }
        }
    }

    /// The outputs that were asked for.
    #[must_use]
    pub fn outputs(&self) -> Outputs {
        self.outputs
    }

    /// The arithmetic the numbers were made with.
    #[must_use]
    pub fn precision(&self) -> Precision {
        match self.values {
            Values::F32(_) => Precision::F32,
            Values::F64(_) => Precision::F64,
        }
    }

    /// Number of frames in the batch.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.t_s.len()
    }

    /// Number of fields in every frame, each counted once for each letter.
    #[must_use]
    pub fn fields(&self) -> usize {
        self.fields
    }

    /// Number of the batch's frame `frame` since the engine started.
    #[must_use]
    pub fn frame_number(&self, frame: usize) -> u64 {
        self.first_frame + frame as u64
    }

    /// Time of the batch's frame `frame`, s.
    #[must_use]
    pub fn t_s(&self, frame: usize) -> f64 {
        self.t_s[frame]
    }

    /// The percept of field `field` in the batch's frame `frame`.
    #[must_use]
    pub fn get(&self, frame: usize, field: usize) -> Percept {
        let cell = frame * self.fields + field;
        let flags = self.flags[cell];
        let present = self.present[cell];
        let has = |output| present.contains(output);
        let mut percept = Percept {
            field,
            letter: field % self.letters,
            contact: !flags.contains(Flags::NO_CONTACT),
            flags,
            total: None,
            peak: None,
            active: has(Outputs::ACTIVE).then(|| self.active[cell]),
            area: None,
            centroid: None,
            position: has(Outputs::POSITION).then(|| self.position[cell]),
            normal: has(Outputs::NORMAL).then(|| self.normal[cell]),
            orientation: None,
            axis: None,
            anisotropy: None,
            displacement: None,
            direction: None,
            distance: None,
            radial_distance: None,
            speed: None,
            radial_speed: None,
            filtered_displacement: has(Outputs::FILTERED_DISPLACEMENT).then(|| self.filtered_displacement[cell]),
            filtered_direction: has(Outputs::FILTERED_DIRECTION).then(|| self.filtered_direction[cell]),
            filtered_speed: has(Outputs::FILTERED_SPEED).then(|| self.filtered_speed[cell]),
            in_world: self.in_world[cell],
        };
        match &self.values {
            Values::F32(columns) => columns.fill(&mut percept, present, cell),
            Values::F64(columns) => columns.fill(&mut percept, present, cell),
        }
        percept
    }

    /// The separate touches of field `field` in the batch's frame `frame`, the oldest first; none unless
    /// [`Outputs::TOUCHES`] was asked for.
    #[must_use]
    pub fn touches(&self, frame: usize, field: usize) -> &[Touch] {
        let cell = frame * self.fields + field;
        let Some(&end) = self.touch_ends.get(cell) else { return &[] };
        let start = if cell == 0 { 0 } else { self.touch_ends[cell - 1] };
        &self.touches[start as usize..end as usize]
    }

    /// Adds the touches of the next cell; cells are filled in their order.
    pub(crate) fn push_touches(&mut self, touches: impl IntoIterator<Item = Touch>) {
        self.touches.extend(touches);
        self.touch_ends.push(self.touches.len() as u32);
    }

    /// Changes a cell's first touch.
    #[cfg(test)]
    pub(crate) fn change_first_touch(&mut self, cell: usize, change: impl Fn(&mut Touch)) {
        let start = if cell == 0 { 0 } else { self.touch_ends[cell - 1] };
        change(&mut self.touches[start as usize]);
    }

    /// All percepts of the batch's frame `frame`, in field order.
    pub fn frame(&self, frame: usize) -> impl Iterator<Item = Percept> + '_ {
        (0..self.fields).map(move |field| self.get(frame, field))
    }

    /// The percepts of the fields in contact in the batch's frame `frame`.
    pub fn touched(&self, frame: usize) -> impl Iterator<Item = Percept> + '_ {
        (0..self.fields).filter(move |&field| self.in_contact(frame, field)).map(move |field| self.get(frame, field))
    }

    /// Whether field `field` is in contact in the batch's frame `frame`.
    pub(crate) fn in_contact(&self, frame: usize, field: usize) -> bool {
        !self.flags[frame * self.fields + field].contains(Flags::NO_CONTACT)
    }
}

impl<T: Copy + Default + Into<f64>> Columns<T> {
    /// A cell's centroid, (u, v, depth), m; depth is 0 where it is not kept.
    pub(crate) fn centroid(&self, cell: usize) -> [f64; 3] {
        let depth = self.centroid_depth.get(cell).copied().unwrap_or_default();
        [self.centroid_u[cell], self.centroid_v[cell], depth].map(Into::into)
    }

    /// Sets a cell's centroid, (u, v, depth), m, in the columns that are kept.
    pub(crate) fn set_centroid(&mut self, cell: usize, [u, v, depth]: [T; 3]) {
        self.centroid_u[cell] = u;
        self.centroid_v[cell] = v;
        if let Some(kept) = self.centroid_depth.get_mut(cell) {
            *kept = depth;
        }
    }

    fn fill(&self, percept: &mut Percept, present: Outputs, cell: usize) {
        let scalar = |output, column: &[T]| present.contains(output).then(|| column[cell].into());
        percept.total = scalar(Outputs::TOTAL, &self.total);
        percept.peak = scalar(Outputs::PEAK, &self.peak);
        percept.area = scalar(Outputs::AREA, &self.area);
        percept.orientation = scalar(Outputs::ORIENTATION, &self.orientation);
        percept.axis = scalar(Outputs::AXIS, &self.axis);
        percept.anisotropy = scalar(Outputs::ANISOTROPY, &self.anisotropy);
        percept.direction = scalar(Outputs::DIRECTION, &self.direction);
        percept.distance = scalar(Outputs::DISTANCE, &self.distance);
        percept.radial_distance = scalar(Outputs::RADIAL_DISTANCE, &self.radial_distance);
        percept.speed = scalar(Outputs::SPEED, &self.speed);
        percept.radial_speed = scalar(Outputs::RADIAL_SPEED, &self.radial_speed);
        percept.displacement = present.contains(Outputs::DISPLACEMENT).then(|| self.displacement[cell].map(Into::into));
        percept.centroid =
            present.contains(Outputs::CENTROID).then(|| [self.centroid_u[cell].into(), self.centroid_v[cell].into()]);
    }
}
