//! A batch of percepts, in columns.

use std::sync::Arc;

use super::columns::{Column, Component, Host, Store};
use super::{Flags, Outputs, Percept, Precision, SelfContact, Touch, TouchFrame};

/// Backends' numbers in one precision, part by part, each a value per cell; a cell is `frame · fields + field`.
///
/// A centroid is (u, v, depth) in the chart; of a field without one, along its anchor's axes from the field's origin.
#[derive(Clone, Debug, PartialEq)]
pub struct Components<T>([Vec<T>; Component::COUNT]);

impl<T> Default for Components<T> {
    fn default() -> Self {
        Self(std::array::from_fn(|_| Vec::new()))
    }
}

index_by_component!(Components<T>, Vec<T>, 0, T);

impl<T> Components<T> {
    pub(super) fn each_mut(&mut self) -> [&mut Vec<T>; Component::COUNT] {
        self.0.each_mut()
    }
}

impl<T: Clone + Default> Components<T> {
    /// Makes room for `cells` cells of each part that is wanted, which keep what they held: backends write every cell.
    fn resize(&mut self, wanted: Outputs, cells: usize) {
        for (&part, column) in Component::ALL.iter().zip(&mut self.0) {
            column.resize(if wanted.intersects(part.kept_for()) { cells } else { 0 }, T::default());
        }
    }
}

/// The columns in the precision of the backend that made them.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Single precision: `cpu` and `gpu`.
    F32(Components<f32>),
    /// Double precision: `reference`.
    F64(Components<f64>),
}

/// The percepts of a batch: `frames × fields` cells, only the outputs that were asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Percepts {
    outputs: Outputs,
    /// The outputs, and what stages work on.
    columns: Outputs,
    pub(super) fields: usize,
    /// By field, its letter; none where there is one letter.
    letters: Arc<[u8]>,
    /// Taxels whose pressures are kept, 0 unless a stage works on them.
    pub(super) slots: usize,
    /// By field; none where nobody said them.
    names: Arc<[String]>,
    #[doc(hidden)]
    pub first_frame: u64,
    #[doc(hidden)]
    pub t_s: Vec<f64>,
    #[doc(hidden)]
    pub in_world: Vec<bool>,
    #[doc(hidden)]
    pub flags: Vec<Flags>,
    /// By cell, the low bits of the outputs that it holds; and the others, where any is asked for.
    pub(crate) present: Vec<u32>,
    pub(super) present_high: Vec<u32>,
    #[doc(hidden)]
    pub active: Vec<u32>,
    #[doc(hidden)]
    pub values: Values,
    /// By [`Host`], each cell's components side by side.
    pub(super) host: [Vec<f64>; Host::COUNT],
    /// P, frame by frame, each taxel by taxel.
    pub(crate) pressures: Vec<f64>,
    self_contacts: Vec<SelfContact>,
    /// Per frame, the end of its self-contacts, and whether they are known.
    self_contact_ends: Vec<(u32, bool)>,
    /// Touches of the whole body by frame, where they are wanted.
    touch_frames: Option<Vec<TouchFrame>>,
}

impl Percepts {
    /// An empty batch for `fields` fields that holds `outputs`.
    #[must_use]
    pub fn new(outputs: Outputs, fields: usize, precision: Precision) -> Self {
        Self {
            outputs,
            columns: outputs,
            fields,
            letters: Arc::default(),
            slots: 0,
            names: Arc::default(),
            first_frame: 0,
            t_s: Vec::new(),
            in_world: Vec::new(),
            flags: Vec::new(),
            present: Vec::new(),
            present_high: Vec::new(),
            active: Vec::new(),
            values: match precision {
                Precision::F32 => Values::F32(Components::default()),
                Precision::F64 => Values::F64(Components::default()),
            },
            host: std::array::from_fn(|_| Vec::new()),
            pressures: Vec::new(),
            self_contacts: Vec::new(),
            self_contact_ends: Vec::new(),
            touch_frames: None,
        }
    }

    /// The same, for fields that are each of the letter that `letters` has for it.
    pub(crate) fn with_letters(mut self, letters: Arc<[u8]>) -> Self {
        self.letters = letters;
        self
    }

    /// Which letter field `field` is of, as [`Plan::letters`](crate::scene::Plan::letters) counts.
    #[must_use]
    pub fn letter(&self, field: usize) -> usize {
        self.letters.get(field).map_or(0, |&letter| letter.into())
    }

    /// The same, of fields called so.
    pub(crate) fn with_names(mut self, names: Arc<[String]>) -> Self {
        self.names = names;
        self
    }

    /// The same, with room for `columns` beside the outputs, and for the pressures of `slots` taxels.
    pub(crate) fn with_columns(mut self, columns: Outputs, slots: usize) -> Self {
        self.columns |= columns;
        self.slots = slots;
        self
    }

    /// The same, with touches of the whole body if they are wanted.
    pub(crate) fn with_touch_frames(mut self, are_wanted: bool) -> Self {
        self.touch_frames = are_wanted.then(Vec::new);
        self
    }

    /// Whether both have room for the same columns of the same fields.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let shape = |of: &Self| {
            (of.outputs, of.columns, of.fields, of.letters.clone(), of.slots, of.precision(), of.touch_frames.is_some())
        };
        shape(self) == shape(other) && Arc::ptr_eq(&self.names, &other.names)
    }

    /// The same with no frames.
    pub(crate) fn empty_like(&self) -> Self {
        Self::new(self.outputs, self.fields, self.precision())
            .with_columns(self.columns, self.slots)
            .with_letters(Arc::clone(&self.letters))
            .with_names(Arc::clone(&self.names))
            .with_touch_frames(self.touch_frames.is_some())
    }

    /// Makes room for `frames` frames, every cell empty. Allocates only when a batch is larger than all before it.
    #[doc(hidden)]
    pub fn reset(&mut self, frames: usize) {
        fn refill<V: Clone>(column: &mut Vec<V>, length: usize, value: V) {
            column.clear();
            column.resize(length, value);
        }
        let cells = frames * self.fields;
        refill(&mut self.t_s, frames, 0.0);
        self.in_world.resize(cells, false);
        self.flags.resize(cells, Flags::empty());
        self.reset_presence(cells);
        self.active.resize(if self.columns.contains(Outputs::ACTIVE) { cells } else { 0 }, 0);
        for (host, values) in Host::ALL.iter().zip(&mut self.host) {
            let column = host.column();
            let numbers = if self.outputs.contains(column.output) { cells * column.components } else { 0 };
            // What the stage *position* gives it gives in every cell.
            if column.stage == "position" {
                values.resize(numbers, 0.0);
            } else {
                refill(values, numbers, 0.0);
            }
        }
        refill(&mut self.pressures, frames * self.slots, 0.0);
        self.self_contacts.clear();
        self.self_contact_ends.clear();
        if let Some(touch_frames) = &mut self.touch_frames {
            touch_frames.resize_with(frames, TouchFrame::default);
            touch_frames.iter_mut().for_each(TouchFrame::clear);
        }
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

    /// The name of field `field` ([`Percept::field`]), with its letter where it is there in several.
    #[must_use]
    pub fn field_name(&self, field: usize) -> &str {
        self.names.get(field).map_or("", String::as_str)
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
        Percept::with((field, self.letter(field)), self.flags[cell], self.in_world[cell], |column| {
            self.present(cell).contains(column.output).then(|| self.components(column, cell))
        })
    }

    /// The quantity of `column` of field `field` in the batch's frame `frame`, its components first, if it is present.
    #[must_use]
    pub fn value(&self, frame: usize, field: usize, column: &Column) -> Option<[f64; 3]> {
        let cell = frame * self.fields + field;
        self.present(cell).contains(column.output).then(|| self.components(column, cell))
    }

    /// The components of `column` in a cell, then zeros.
    fn components(&self, column: &Column, cell: usize) -> [f64; 3] {
        fn read<T: Copy + Into<f64>>(parts: &Components<T>, which: &[Component], cell: usize) -> [f64; 3] {
            let mut components = [0.0; 3];
            components.iter_mut().zip(which).for_each(|(component, &part)| *component = parts[part][cell].into());
            components
        }
        match (column.store, &self.values) {
            (Store::Active, _) => [self.active[cell].into(), 0.0, 0.0],
            (Store::Backend(which), Values::F32(parts)) => read(parts, which, cell),
            (Store::Backend(which), Values::F64(parts)) => read(parts, which, cell),
            (Store::Host(host), _) => {
                let mut components = [0.0; 3];
                components[..column.components].copy_from_slice(self.host(host, cell));
                components
            }
        }
    }

    /// A cell's components of what the host makes.
    pub(super) fn host(&self, host: Host, cell: usize) -> &[f64] {
        let count = host.column().components;
        &self.host[host as usize][cell * count..][..count]
    }

    pub(super) fn has_host(&self, host: Host) -> bool {
        !self.host[host as usize].is_empty()
    }

    /// Sets them, if the output is asked for.
    #[doc(hidden)]
    pub fn set_host(&mut self, host: Host, cell: usize, components: &[f64]) {
        let column = &mut self.host[host as usize];
        if !column.is_empty() {
            column[cell * components.len()..][..components.len()].copy_from_slice(components);
        }
    }

    /// The touches of the whole body in the batch's frame `frame`; `None` unless [`Scene::touches`](crate::scene::Scene::touches) asks for
    /// them.
    #[must_use]
    pub fn touches(&self, frame: usize) -> Option<&TouchFrame> {
        self.touch_frames.as_ref().map(|frames| &frames[frame])
    }

    /// Takes those of frame `frame` out, to be filled in and [put back](Self::put_touch_frame).
    pub(crate) fn take_touch_frame(&mut self, frame: usize) -> TouchFrame {
        self.touch_frames.as_mut().and_then(|frames| frames.get_mut(frame)).map(std::mem::take).unwrap_or_default()
    }

    /// A touch of the whole body: its frame, and its place there.
    pub(crate) fn touch_mut(&mut self, (frame, touch): (usize, usize)) -> Option<&mut Touch> {
        self.touch_frames.as_mut()?.get_mut(frame)?.touches.get_mut(touch)
    }

    pub(crate) fn put_touch_frame(&mut self, frame: usize, found: TouchFrame) {
        if let Some(place) = self.touch_frames.as_mut().and_then(|frames| frames.get_mut(frame)) {
            *place = found;
        }
    }

    /// The self-contacts of the batch's frame `frame`: touches of two links at one place in the world. `None` where it is touched and
    /// no touch's place in the world is known, and unless [`Outputs::SELF_CONTACTS`] was asked for.
    #[must_use]
    pub fn self_contacts(&self, frame: usize) -> Option<&[SelfContact]> {
        let &(end, is_known) = self.self_contact_ends.get(frame)?;
        let start = if frame == 0 { 0 } else { self.self_contact_ends[frame - 1].0 };
        is_known.then(|| &self.self_contacts[start as usize..end as usize])
    }

    /// Adds the self-contacts of the next frame.
    pub(crate) fn push_self_contacts(&mut self, self_contacts: impl IntoIterator<Item = SelfContact>, are_known: bool) {
        self.self_contacts.extend(self_contacts);
        self.self_contact_ends.push((self.self_contacts.len() as u32, are_known));
    }

    /// All percepts of the batch's frame `frame`, in field order.
    pub fn frame(&self, frame: usize) -> impl Iterator<Item = Percept> + '_ {
        (0..self.fields).map(move |field| self.get(frame, field))
    }

    /// The percepts of the fields in contact in the batch's frame `frame`.
    pub fn touched(&self, frame: usize) -> impl Iterator<Item = Percept> + '_ {
        (0..self.fields).filter(move |&field| self.in_contact(frame, field)).map(move |field| self.get(frame, field))
    }

    /// Why quantities of field `field` in the batch's frame `frame` are absent or in doubt.
    #[doc(hidden)]
    pub fn flags(&self, frame: usize, field: usize) -> Flags {
        self.flags[frame * self.fields + field]
    }

    /// Whether its position and normal are in the world.
    #[doc(hidden)]
    pub fn in_world(&self, frame: usize, field: usize) -> bool {
        self.in_world[frame * self.fields + field]
    }

    #[doc(hidden)]
    pub fn in_contact(&self, frame: usize, field: usize) -> bool {
        !self.flags[frame * self.fields + field].contains(Flags::NO_CONTACT)
    }
}

impl<T: Copy + Default + Into<f64>> Components<T> {
    /// A cell's centroid, (u, v, depth), m; depth is 0 where it is not kept.
    pub(crate) fn centroid(&self, cell: usize) -> [f64; 3] {
        let depth = self[Component::CentroidDepth].get(cell).copied().unwrap_or_default();
        [self[Component::CentroidU][cell], self[Component::CentroidV][cell], depth].map(Into::into)
    }
}
