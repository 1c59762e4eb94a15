//! From the pressures of a frame to its touches.

use std::sync::Arc;

use super::bridges::Bridges;
use super::identity::{Identities, Kept, KeptTaxel, Memory};
use super::measure::{Felt, Measure, add_links};
use super::options::Options;
use super::regions::{Pressures, Regions};
use super::skin::Skin;
use super::trail::Trail;
use crate::percept::{LinkShare, TouchFlags, TouchFrame, TouchOutputs};

/// Pressures that are looked at together.
const CHUNK: usize = 128;

/// What is less counts as 0, and what is more is not believed, as at calibration: sums neither vanish nor overflow.
pub(super) const LEAST_PRESSURE: f64 = 1.0 / (1_u64 << 60) as f64;
pub(super) const MOST_PRESSURE: f64 = (1_u64 << 60) as f64;

/// In no region, or no touch.
const NONE: u32 = u32::MAX;

/// A frame's pressures.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a, P> {
    /// When it was, s.
    pub t_s: f64,
    /// Whether time starts again with it: nothing is kept over that.
    pub restarts: bool,
    /// P by node: what is not from 2⁻⁶⁰ to 2⁶⁰ is not pressed.
    pub pressures: &'a [P],
    /// Nodes without a value, missing or masked, ascending: their neighbours are each other's.
    pub without_value: &'a [u32],
    /// Flags of nodes, with or without a value. A node without a value and without flags is missing.
    pub notes: &'a [(u32, TouchFlags)],
}

impl<'a, P> Input<'a, P> {
    /// All there is to be said of a frame in which every taxel has a value.
    #[must_use]
    pub fn new(t_s: f64, pressures: &'a [P]) -> Self {
        Self { t_s, restarts: false, pressures, without_value: &[], notes: &[] }
    }
}

/// What the next touches depend on beside the next frames.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TouchState(pub(super) Memory);

/// Finds the touches of a skin, frame after frame.
///
/// ```
/// # mod somatic { pub use somatic_bodies as bundled; pub use somatic_engine::{Engine, Options, percept::TouchFrame, scene::Scene, touch}; pub use somatic_skin::{body::Body, error::Result, signal, signal::RawValue}; }
/// use somatic::TouchFrame;
/// use somatic::touch::{Input, Skin, SkinParts, Touches};
/// use std::sync::Arc;
///
/// let skin = Arc::new(Skin::from_parts(SkinParts::default()));
/// let mut touches = Touches::new(skin, Default::default());
/// let mut frame = TouchFrame::default();
/// touches.step(Input::<f32>::new(0.0, &[]), &mut frame);
/// assert!(frame.touches.is_empty());
/// ```
#[derive(Clone, Debug)]
pub struct Touches {
    skin: Arc<Skin>,
    options: Options,
    memory: Memory,
    bridges: Bridges,
    /// The pressed nodes of the last frame, ascending.
    pressed: Vec<u32>,
    /// P by node; 0 for all that are not in `pressed`.
    pressures: Vec<f64>,
    /// By node the touch of the frame before, an index of those that `memory` keeps.
    touch_before: Vec<u32>,
    /// By pressed node its region.
    region_of: Vec<u32>,
    regions: Regions,
    totals: Vec<f64>,
    identities: Identities,
    notes: Vec<TouchFlags>,
    measure: Measure,
    /// The touches of this frame, while those before are still needed.
    kept: Vec<Kept>,
    /// By region the identity of its touch, 0 if it is none.
    id_of_region: Vec<u64>,
}

impl Touches {
    /// Of `skin`.
    #[must_use]
    pub fn new(skin: Arc<Skin>, options: Options) -> Self {
        let nodes = skin.nodes();
        Self {
            options,
            memory: Memory::default(),
            bridges: Bridges::default(),
            pressed: Vec::with_capacity(nodes),
            pressures: vec![0.0; nodes],
            touch_before: vec![NONE; nodes],
            region_of: vec![NONE; nodes],
            regions: Regions::default(),
            totals: Vec::new(),
            identities: Identities::default(),
            notes: Vec::new(),
            measure: Measure::default(),
            kept: Vec::new(),
            id_of_region: Vec::new(),
            skin,
        }
    }

    /// From now on gives the taxels of touches too.
    pub(crate) fn keep_taxels(&mut self) {
        self.options.outputs |= TouchOutputs::TAXELS;
    }

    /// The skin.
    #[must_use]
    pub fn skin(&self) -> &Skin {
        &self.skin
    }

    /// What is asked of touches.
    pub(crate) fn options(&self) -> &Options {
        &self.options
    }

    /// The state after the frames so far.
    #[must_use]
    pub fn state(&self) -> TouchState {
        TouchState(self.memory.clone())
    }

    /// The taxels of each touch of the last frame, as nodes in no order, the oldest touch first.
    pub(crate) fn taxels(&self) -> impl Iterator<Item = &[u32]> + '_ {
        self.identities.named().iter().map(|named| self.regions.members(named.region as usize))
    }

    /// Goes on from `state`, of the same skin and options: the touches are the same bits as without an interruption.
    pub fn restore(&mut self, state: &TouchState) {
        self.memory.clone_from(&state.0);
        self.touch_before.fill(NONE);
        self.note_before();
    }

    /// Puts the touches of the next frame into `out`, in place of what it holds.
    pub fn step<P: Copy + Default + PartialOrd + Into<f64>>(&mut self, input: Input<'_, P>, out: &mut TouchFrame) {
        out.clear();
        if input.restarts {
            self.release(out);
        }
        self.bridges.set(&self.skin, input.without_value);
        self.take(input.pressures);
        if self.pressed.is_empty() {
            self.release(out);
            return;
        }
        self.find_regions();
        self.set_notes(input.notes);
        self.name(out);
        self.measure(input.t_s, out);
        self.keep(out);
        self.clear_notes(input.notes);
    }

    /// Puts into `out`, in place of what it holds, the sum and the wrench of all pressed taxels of the last frame by link, in the
    /// body's order, whatever touches they are of. A wrench is of the forces along the normals, and absent where one is unknown.
    pub fn on_links(&self, out: &mut Vec<LinkShare>) {
        let felt = Felt {
            skin: &self.skin,
            bridges: &self.bridges,
            pressures: &self.pressures,
            notes: &[],
            wanted: TouchOutputs::WRENCH,
        };
        out.clear();
        add_links(&felt, &self.pressed, out);
    }

    /// The pressed taxels of the last frame, as ascending nodes, and P of each.
    pub(crate) fn pressed(&self) -> impl Iterator<Item = (u32, f64)> + '_ {
        self.pressed.iter().map(|&node| (node, self.pressures[node as usize]))
    }

    /// Makes these the pressed taxels of the last frame, as [`Touches::pressed`] gave them, for [`Touches::on_links`]; the next frame does
    /// not depend on them.
    pub(crate) fn set_pressed(&mut self, pressed: &[(u32, f64)]) {
        for &node in &self.pressed {
            self.pressures[node as usize] = 0.0;
        }
        self.pressed.clear();
        for &(node, pressure) in pressed {
            self.pressures[node as usize] = pressure;
            self.pressed.push(node);
        }
    }

    /// Takes the pressures of a frame.
    fn take<P: Copy + Default + PartialOrd + Into<f64>>(&mut self, pressures: &[P]) {
        for &node in &self.pressed {
            self.pressures[node as usize] = 0.0;
        }
        self.pressed.clear();
        let zero = P::default();
        let pressures = &pressures[..pressures.len().min(self.skin.nodes())];
        for (index, chunk) in pressures.chunks(CHUNK).enumerate() {
            // No branch, so that it is done in lanes: most of a skin is not pressed.
            if !chunk.iter().fold(false, |any, pressure| any | (*pressure > zero)) {
                continue;
            }
            for (node, &pressure) in (index * CHUNK..).zip(chunk) {
                let pressure: f64 = pressure.into();
                if (LEAST_PRESSURE..=MOST_PRESSURE).contains(&pressure) && self.bridges.has_value(node as u32) {
                    self.pressures[node] = pressure;
                    self.pressed.push(node as u32);
                }
            }
        }
    }

    /// Ends all touches.
    fn release(&mut self, out: &mut TouchFrame) {
        if self.memory.touches.is_empty() {
            return;
        }
        out.released.extend(self.memory.touches.iter().map(|kept| kept.id));
        self.forget_before();
        self.memory.touches.clear();
        self.memory.taxels.clear();
        self.memory.two.clear();
    }

    fn forget_before(&mut self) {
        for taxel in &self.memory.taxels {
            if let Some(before) = self.touch_before.get_mut(taxel.node as usize) {
                *before = NONE;
            }
        }
    }

    fn note_before(&mut self) {
        for taxel in &self.memory.taxels {
            if let Some(before) = self.touch_before.get_mut(taxel.node as usize) {
                *before = taxel.touch;
            }
        }
    }

    fn find_regions(&mut self) {
        let Self { skin, bridges, pressures, memory, touch_before, regions, .. } = self;
        let were_two = |high: u32, low: u32| {
            let [a, b] = [high, low].map(|node| touch_before[node as usize]);
            if a == b || a == NONE || b == NONE {
                return false;
            }
            let id = |touch: u32| memory.touches[touch as usize].id;
            memory.two.binary_search(&in_order(id(a), id(b))).is_ok()
        };
        let on = Pressures { skin, bridges, of: pressures };
        regions.find(&on, &self.pressed, &self.options.splits, were_two);
        self.totals.clear();
        for region in 0..regions.count() {
            let members = regions.members(region);
            self.totals.push(members.iter().map(|&node| pressures[node as usize]).sum());
            members.iter().for_each(|&node| self.region_of[node as usize] = region as u32);
        }
    }

    fn set_notes(&mut self, notes: &[(u32, TouchFlags)]) {
        if !notes.is_empty() && self.notes.is_empty() {
            self.notes.resize(self.skin.nodes(), TouchFlags::empty());
        }
        for &(node, note) in notes {
            if let Some(noted) = self.notes.get_mut(node as usize) {
                *noted |= note;
            }
        }
    }

    fn clear_notes(&mut self, notes: &[(u32, TouchFlags)]) {
        for &(node, _) in notes {
            if let Some(noted) = self.notes.get_mut(node as usize) {
                *noted = TouchFlags::empty();
            }
        }
    }

    fn name(&mut self, out: &mut TouchFrame) {
        let Self { identities, memory, totals, options, region_of, pressures, .. } = self;
        let region = |node: u32| {
            let pressure = pressures.get(node as usize).copied().filter(|pressure| *pressure > 0.0)?;
            Some((region_of[node as usize], pressure))
        };
        identities.name(memory, totals, options, region);
        let named = identities.named();
        let stays = |id: u64| named.binary_search_by_key(&id, |named| named.id).is_ok();
        out.released.extend(memory.touches.iter().map(|kept| kept.id).filter(|&id| !stays(id)));
    }

    fn measure(&mut self, t_s: f64, out: &mut TouchFrame) {
        let felt = Felt {
            skin: &self.skin,
            bridges: &self.bridges,
            pressures: &self.pressures,
            notes: &self.notes,
            wanted: self.options.outputs,
        };
        self.kept.clear();
        for named in self.identities.named() {
            let place = self.measure.touch(&felt, self.regions.members(named.region as usize), out);
            let Some(touch) = out.touches.last_mut() else { continue };
            let new = Kept { id: named.id, began_s: t_s, link: touch.link, trail: Trail::default() };
            let mut kept = named.continues.map_or(new, |before| self.memory.touches[before as usize]);
            touch.begins_anew = named.continues.is_none() || kept.link != touch.link || named.merged || named.parted;
            if touch.begins_anew {
                kept.trail.clear();
            }
            (kept.id, kept.link) = (named.id, touch.link);
            let velocity = kept.trail.follow(t_s, place.position, self.options.velocity_over_s);
            let link_from_body = self.skin.link_from_body(touch.link);
            touch.velocity = velocity.map(|velocity| link_from_body.transform_vector3(velocity));
            (touch.id, touch.age_s) = (named.id, kept.age_s(t_s));
            if velocity.is_none() {
                touch.flags |= TouchFlags::YOUNG;
            }
            if named.merged {
                touch.flags |= TouchFlags::MERGED;
            }
            self.kept.push(kept);
        }
    }

    /// Keeps what the next frame needs.
    fn keep(&mut self, out: &TouchFrame) {
        self.forget_before();
        let memory = &mut self.memory;
        std::mem::swap(&mut memory.touches, &mut self.kept);
        memory.taxels.clear();
        self.id_of_region.clear();
        self.id_of_region.resize(self.regions.count(), 0);
        for (touch, named) in (0..).zip(self.identities.named()) {
            self.id_of_region[named.region as usize] = named.id;
            let members = self.regions.members(named.region as usize);
            let taxel = |&node: &u32| KeptTaxel { node, touch, pressure: self.pressures[node as usize] };
            memory.taxels.extend(members.iter().map(taxel));
        }
        if !out.released.is_empty() {
            memory.two.retain(|pair| pair.iter().all(|id| out.released.binary_search(id).is_err()));
        }
        let known = memory.two.len();
        for pair in self.regions.two() {
            let [a, b] = pair.map(|peak| self.region_of[peak as usize]);
            let is_peak = |region: u32, peak: u32| self.regions.members(region as usize)[0] == peak;
            let [of_a, of_b] = [a, b].map(|region| self.id_of_region[region as usize]);
            if is_peak(a, pair[0]) && is_peak(b, pair[1]) && of_a > 0 && of_b > 0 {
                memory.two.push(in_order(of_a, of_b));
            }
        }
        if memory.two.len() > known {
            memory.two.sort_unstable();
            memory.two.dedup();
        }
        self.note_before();
    }
}

fn in_order(a: u64, b: u64) -> [u64; 2] {
    [a.min(b), a.max(b)]
}
