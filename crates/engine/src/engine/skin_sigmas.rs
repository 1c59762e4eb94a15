//! How sure touches of the whole body are: [`crate::stage::sigma`] in the chart of each touch.
//!
//! It starts from the raw values, in double precision, whatever the backend; which taxels are one touch is the backend's to say. Beside
//! those count the taxels next to them that nothing presses: one that is near its threshold may be pressed in the next frame. Of noise
//! that moves the border between two touches nothing is known.
//!
//! The position is the point of the skin nearest to the mean in space. On a plane its standard deviation is that of the mean in the
//! chart. Around a limb both move nearly alike: the mean in space moves less, by the cosines, and lies under the skin, which gives most
//! of it back. Of a touch that reaches 50° to either side the chart's is 2 to 3 % too large.

use glam::DVec2;

use crate::backend::{RawBatch, sigma};
use crate::percept::{Flags, TouchFlags, TouchFrame, TouchOutputs};
use crate::scene::Plan;
use crate::stage::sigma::{Felt, Sigmas, reference};
use crate::touch::Skin;

/// Finds how sure touches are.
#[derive(Debug)]
pub(super) struct SkinSigmas {
    wanted: TouchOutputs,
    /// Memory: the taxels of a touch and those beside them, and what these feel.
    near: Vec<u32>,
    felt: Vec<Felt>,
}

impl SkinSigmas {
    /// `None` where none of them is asked for.
    pub(super) fn new(wanted: TouchOutputs) -> Option<Self> {
        let wanted = wanted.intersection(TouchOutputs::SIGMAS);
        (!wanted.is_empty()).then(|| Self { wanted, near: Vec::new(), felt: Vec::new() })
    }

    /// Puts into the touches of frame `offset` of `raw`, which are `found`, how sure they are. `pressures` has P by node.
    pub(super) fn add(
        &mut self,
        (plan, skin): (&Plan, &Skin),
        raw: &RawBatch<'_>,
        offset: usize,
        pressures: &[f64],
        found: &mut TouchFrame,
    ) {
        for index in 0..found.touches.len() {
            let touch = &found.touches[index];
            self.near.clear();
            for &node in found.taxels(touch) {
                self.near.push(node);
                let is_pressed = |node: u32| pressures.get(node as usize).is_some_and(|pressure| *pressure > 0.0);
                self.near.extend(skin.beside(node).iter().filter(|node| !is_pressed(**node)));
            }
            self.near.sort_unstable();
            self.near.dedup();
            let is_wrapped = touch.flags.contains(TouchFlags::WRAPPED);
            let sigmas = self.sigmas((plan, skin), raw, offset, (touch.base, touch.link), !is_wrapped);
            let has_axis = touch.principal_axis_rad.is_some();
            let touch = &mut found.touches[index];
            let asks = |output: TouchOutputs| self.wanted.contains(output);
            touch.total_sigma = sigmas.total.filter(|_| asks(TouchOutputs::TOTAL_SIGMA));
            let position = sigmas.centroid.filter(|_| asks(TouchOutputs::POSITION_SIGMA));
            touch.position_sigma_m = position.map(|sigma| sigma.to_array());
            let of_axis = sigmas.principal_axis.filter(|_| has_axis && asks(TouchOutputs::PRINCIPAL_AXIS_SIGMA));
            touch.principal_axis_sigma_rad = of_axis;
            let lacks = [
                asks(TouchOutputs::TOTAL_SIGMA) && sigmas.total.is_none(),
                asks(TouchOutputs::POSITION_SIGMA) && !is_wrapped && position.is_none(),
                asks(TouchOutputs::PRINCIPAL_AXIS_SIGMA) && has_axis && of_axis.is_none(),
            ];
            if sigmas.flags.contains(Flags::NOISE_UNKNOWN) {
                touch.flags |= TouchFlags::NOISE_UNKNOWN;
            } else if touch.active > 1 && lacks.contains(&true) {
                touch.flags |= TouchFlags::UNSURE;
            }
        }
    }

    /// How sure a touch is that is felt by the taxels `near`, in the chart based at `base` with the u of `link`.
    fn sigmas(
        &mut self,
        (plan, skin): (&Plan, &Skin),
        raw: &RawBatch<'_>,
        offset: usize,
        (base, link): (u32, u32),
        charted: bool,
    ) -> Sigmas {
        let first_slot = plan.touched_from.unwrap_or(0);
        let felt = |node: u32, place_m: DVec2| {
            let felt = sigma::felt(plan, first_slot + node as usize, raw.rows.value(offset, node as usize))?;
            let weight = skin.taxels()[node as usize].weight();
            Some(Felt { weight, weight_in_total: 1.0, place_m, ..felt })
        };
        self.felt.clear();
        if charted {
            let near = skin.unrolled(base, link, self.near.iter().copied());
            let places = near.nodes.iter().zip(&near.places_m);
            self.felt.extend(places.filter_map(|(&node, &place_m)| felt(node, place_m)));
        } else {
            self.felt.extend(self.near.iter().filter_map(|&node| felt(node, DVec2::ZERO)));
        }
        reference(&self.felt, charted)
    }
}
