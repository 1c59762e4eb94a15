//! What presses, fitted to touches of the whole body: [`crate::stage::fit`] in the chart of each touch.
//!
//! It starts from the raw values, in double precision on the CPU, whatever the backend; which taxels are one touch is the backend's to
//! say. All touches of a call are fitted together.

use glam::{DAffine3, DVec2};

use crate::backend::RawBatch;
use crate::backend::cpu::fit::fit_each;
use crate::percept::{Fit, Flags, Percepts, TouchFit, TouchFlags, TouchFrame};
use crate::scene::{Plan, REACH};
use crate::signal::{LayerResponse, RawValue};
use crate::stage::fit::{self, Layer};
use crate::touch::{Skin, Unrolled};

/// Touches of a call that wait to be fitted.
#[derive(Debug)]
pub(super) struct SkinFits {
    layer: Option<LayerResponse>,
    steps: usize,
    waiting: Vec<Waiting>,
    /// Memory: the taxels of a touch and those beside them.
    near: Vec<u32>,
}

#[derive(Debug)]
struct Waiting {
    /// The frame and the touch, as percepts count them.
    at: (usize, usize),
    unrolled: Unrolled,
    touch: fit::Touch,
    link: u32,
    world_from_link: Option<DAffine3>,
}

impl SkinFits {
    pub(super) fn new(layer: Option<LayerResponse>, steps: usize) -> Self {
        Self { layer, steps, waiting: Vec::new(), near: Vec::new() }
    }

    /// Takes the touches of frame `offset` of `raw`, which are `found`. `poses` say where links are in the world, if they do.
    pub(super) fn take(
        &mut self,
        (plan, skin): (&Plan, &Skin),
        raw: &RawBatch<'_>,
        offset: usize,
        poses: &[Option<DAffine3>],
        found: &mut TouchFrame,
    ) {
        for index in 0..found.touches.len() {
            let touch = &found.touches[index];
            if touch.flags.contains(TouchFlags::WRAPPED) {
                continue;
            }
            self.near.clear();
            for &node in found.taxels(touch) {
                self.near.push(node);
                self.near.extend_from_slice(skin.beside(node));
            }
            self.near.sort_unstable();
            self.near.dedup();
            let unrolled = skin.unrolled(touch.base, touch.link, self.near.iter().copied());
            let value = |node: u32| raw.rows.value(offset, node as usize);
            match self.fittable(plan, skin, &unrolled, value) {
                Ok(ready) => self.waiting.push(Waiting {
                    at: (raw.first + offset, index),
                    unrolled,
                    touch: ready,
                    link: touch.link,
                    world_from_link: poses.get(touch.link as usize).copied().flatten(),
                }),
                Err(why) => found.touches[index].flags |= why,
            }
        }
    }

    /// The taxels `near` a touch as fits take them, of those whose values can be used.
    fn fittable(
        &self,
        plan: &Plan,
        skin: &Skin,
        near: &Unrolled,
        value: impl Fn(u32) -> RawValue,
    ) -> Result<fit::Touch, TouchFlags> {
        let LayerResponse { sigma_m, gain_spread } = self.layer.ok_or(TouchFlags::NO_LAYER)?;
        let first_slot = plan.touched_from.unwrap_or(0);
        let mut taxels = Vec::with_capacity(near.nodes.len());
        for (&node, &place_m) in near.nodes.iter().zip(&near.places_m) {
            let quantity = plan.calibrations[node as usize].quantity;
            let Some(taxel) = plan.felt(first_slot + node as usize, quantity, place_m, value(node)) else { continue };
            if taxel.area_m2 <= 0.0 {
                return Err(TouchFlags::NO_LAYER);
            }
            taxels.push(taxel);
        }
        if !taxels.iter().any(|taxel| taxel.pressure > 0.0) {
            return Err(TouchFlags::FEW_TAXELS);
        }
        let place_of = |node: u32| near.nodes.binary_search(&node).ok().map(|at| near.places_m[at]);
        let ways = near.nodes.iter().zip(&near.places_m).flat_map(|(&node, from)| {
            skin.beside(node).iter().filter_map(move |&other| place_of(other)).map(|to| from.distance(to))
        });
        let reach_m = REACH * ways.fold(0.0, f64::max);
        Ok(fit::Touch::new(&taxels, &Layer { sigma_m, gain_spread, reach_m, steps: self.steps }))
    }

    /// Fits all that wait, and puts what comes of them into `percepts`.
    pub(super) fn finish(&mut self, skin: &Skin, percepts: &mut Percepts) {
        let touches: Vec<&fit::Touch> = self.waiting.iter().map(|waiting| &waiting.touch).collect();
        let fitted = fit_each(&touches, fit::Touch::conclude);
        for (waiting, (fit, flags)) in self.waiting.drain(..).zip(fitted) {
            let Some(touch) = percepts.touch_mut(waiting.at) else { continue };
            touch.flags |= said(flags);
            touch.fit = fit.map(|fit| waiting.on_skin(skin, &fit));
        }
    }
}

impl Waiting {
    fn on_skin(&self, skin: &Skin, fit: &Fit) -> TouchFit {
        let (place, direction) = self.unrolled.on_skin(skin, DVec2::from_array(fit.place), fit.angle);
        let from_body = self.world_from_link.unwrap_or(DAffine3::IDENTITY) * skin.link_from_body(self.link);
        TouchFit {
            kind: fit.kind,
            place: from_body.transform_point3(place),
            force: fit.force,
            direction: direction.map(|direction| from_body.transform_vector3(direction)),
            angle_rad: fit.angle,
            width_m: fit.width,
            length_m: fit.length,
            sigma: fit.sigma,
        }
    }
}

/// What a fit says, of a touch.
fn said(flags: Flags) -> TouchFlags {
    let pairs = [
        (Flags::FEW_TAXELS, TouchFlags::FEW_TAXELS),
        (Flags::OFF_FIELD, TouchFlags::OFF_SKIN),
        (Flags::POOR_FIT, TouchFlags::POOR_FIT),
        (Flags::NO_LAYER, TouchFlags::NO_LAYER),
    ];
    pairs.into_iter().filter(|(of_field, _)| flags.contains(*of_field)).map(|(_, of_touch)| of_touch).collect()
}
