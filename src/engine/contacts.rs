//! Contacts of a frame: [`crate::stage::contacts`] over the touches that post-processing has found.

use std::collections::BTreeSet;

use glam::DVec3;

use super::place::{self, Links};
use crate::body::Body;
use crate::error::{Error, Result};
use crate::field::{ContactTolerance, rest_overlaps};
use crate::percept::{Contact, ContactSide, Flags, Outputs, Percepts};
use crate::scene::{Coordinates, Plan, Scene};
use crate::signal::Frame;
use crate::stage::contacts::{Memory, Side, pairs};

/// Which fields can be in contact, and when two touches are.
pub(super) struct Contacts {
    /// By field of the plan, its link, if all of its taxels are on one and no other field divides it.
    links: Vec<Option<usize>>,
    tolerance: ContactTolerance,
    /// Pairs of links that are within the tolerance at rest.
    overlaps: BTreeSet<[usize; 2]>,
}

impl Contacts {
    /// `None` where contacts are not asked for.
    pub(super) fn new(body: &Body, plan: &Plan, scene: &Scene) -> Result<Option<Self>> {
        if !plan.outputs.contains(Outputs::CONTACTS) {
            return Ok(None);
        }
        if scene.coordinates == Coordinates::Anchor {
            return Err(Error::usage(
                "contacts are places in the world; leave out coordinates `anchor`, or `contacts`",
            ));
        }
        let tolerance = ContactTolerance::new(body, scene.contact_tolerance_m);
        let link = |field| {
            let field: &crate::scene::PlanField = field;
            let mut taxels = plan.members_of(field).iter().map(|member| plan.channel_of(member.slot as usize));
            let is_on_anchor = |channel: usize| Some(body.taxels[plan.body_taxels[channel]].link) == field.anchor;
            field.anchor.filter(|_| !field.divided && taxels.all(is_on_anchor))
        };
        Ok(Some(Self {
            links: plan.fields.iter().map(link).collect(),
            overlaps: rest_overlaps(body, &tolerance).into_iter().map(|overlap| overlap.links).collect(),
            tolerance,
        }))
    }

    /// Finds the contacts of `frame`, the next of `percepts`, whose touches are there.
    pub(super) fn find(
        &self,
        plan: &Plan,
        links: &Links,
        frame: &Frame,
        index: usize,
        percepts: &mut Percepts,
        memory: &mut Memory,
    ) {
        let mut sides = Vec::new();
        let (mut touched, mut placed) = (false, false);
        for (number, field) in plan.fields.iter().enumerate() {
            if !percepts.in_contact(index, number) {
                continue;
            }
            let world = links.world_from_anchor(field, frame);
            if world.is_none() {
                percepts.flags[index * plan.fields.len() + number] |= Flags::NO_POSE;
            }
            let Some(link) = self.links[number] else { continue };
            touched = true;
            let Some(world) = world else { continue };
            placed = true;
            sides.extend(percepts.touches(index, number).iter().map(|touch| {
                let normal = touch.centroid.map(|[u, v]| place::on_skin(field, DVec3::new(u, v, 0.0)).1);
                Side {
                    field: number,
                    touch: touch.id,
                    link,
                    letter: field.letter,
                    total: touch.total,
                    position: DVec3::from_array(touch.position),
                    normal: normal.map(|normal| world.transform_vector3(normal)),
                }
            }));
        }
        memory.release(|field, id| percepts.touches(index, field).iter().any(|touch| touch.id == id));
        let found =
            pairs(&sides, |a, b| self.tolerance.between_m(a, b), |a, b| self.overlaps.contains(&[a.min(b), a.max(b)]));
        let contact = |pair: &crate::stage::contacts::Pair| {
            let both = pair.sides.map(|side| &sides[side]);
            let side = |side: &Side| ContactSide { field: side.field, touch: side.touch, total: side.total };
            let position = (both[0].position + both[1].position) / 2.0;
            let id = memory.id_of(both);
            Contact::new(id, both.map(side), position.to_array(), pair.distance_m, pair.angle_rad)
        };
        let contacts: Vec<Contact> = found.iter().map(contact).collect();
        percepts.push_contacts(contacts, placed || !touched);
    }
}
