//! Self-contacts of a frame: [`crate::stage::self_contacts`] over its touches.

use crate::body::Body;
use crate::field::ContactTolerance;
use crate::percept::{Outputs, SelfContact, SelfContactSide, TouchFrame};
use crate::scene::{Plan, Scene};
use crate::stage::self_contacts::{Memory, Pair, Side, pairs};

/// When two touches are one contact, and which contacts there are.
#[derive(Debug)]
pub(super) struct SelfContacts {
    tolerance: ContactTolerance,
    memory: Memory,
}

impl SelfContacts {
    /// `None` where self-contacts are not asked for.
    pub(super) fn new(body: &Body, plan: &Plan, scene: &Scene) -> Option<Self> {
        let are_wanted = plan.outputs().contains(Outputs::SELF_CONTACTS);
        are_wanted.then(|| Self {
            tolerance: ContactTolerance::new(body, scene.contact_tolerance_m),
            memory: Memory::default(),
        })
    }

    pub(super) fn state(&self) -> Memory {
        self.memory.clone()
    }

    pub(super) fn restore(&mut self, state: &Memory) {
        self.memory.clone_from(state);
    }

    /// The self-contacts of a frame, whose touches are `found`, and whether they are known: those of touches that are in the world.
    pub(super) fn find(&mut self, found: &TouchFrame, restarts: bool) -> (Vec<SelfContact>, bool) {
        let in_world = found.touches.iter().filter(|touch| touch.in_world);
        let mut sides: Vec<Side> = in_world
            .map(|touch| Side {
                touch: touch.id,
                link: touch.link as usize,
                total: touch.total,
                position: touch.position,
                normal: touch.normal,
            })
            .collect();
        sides.sort_by_key(|side| (side.link, side.touch));
        if restarts {
            self.memory.restart();
        }
        self.memory.release(|id| found.touches.iter().any(|touch| touch.id == id));
        let contact = |pair: &Pair| {
            let both = pair.sides.map(|side| &sides[side]);
            let side = |side: &Side| SelfContactSide { link: side.link as u32, touch: side.touch, total: side.total };
            let position = (both[0].position + both[1].position) / 2.0;
            let id = self.memory.id_of(both);
            SelfContact::new(id, both.map(side), position.to_array(), pair.distance_m, pair.angle_rad)
        };
        let contacts = pairs(&sides, |a, b| self.tolerance.between_m(a, b)).iter().map(contact).collect();
        (contacts, !sides.is_empty() || found.touches.is_empty())
    }
}
