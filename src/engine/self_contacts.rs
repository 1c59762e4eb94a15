//! Self-contacts of a frame: [`crate::stage::self_contacts`] over the touches that post-processing has found.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::links::Links;
use super::place;
use crate::body::Body;
use crate::field::{ContactTolerance, rest_overlaps};
use crate::percept::{Flags, Outputs, Percepts, SelfContact, SelfContactSide};
use crate::scene::{Plan, PlanField, Scene};
use crate::signal::Frame;
use crate::stage::self_contacts::{Memory, Side, pairs};

/// Which fields can be in contact, and when two touches are.
pub(super) struct SelfContacts {
    /// By field of the plan, its link, if its touches can be in contact.
    links: Vec<Option<usize>>,
    tolerance: ContactTolerance,
    /// Pairs of links that are within the tolerance at rest.
    overlaps: BTreeSet<[usize; 2]>,
}

impl SelfContacts {
    /// `None` where self-contacts are not asked for.
    pub(super) fn new(body: &Body, plan: &Plan, scene: &Scene) -> Option<Self> {
        if !plan.outputs.contains(Outputs::SELF_CONTACTS) {
            return None;
        }
        let tolerance = ContactTolerance::new(body, scene.contact_tolerance_m);
        Some(Self {
            links: links_in_contact(body, plan),
            overlaps: rest_overlaps(body, &tolerance).into_iter().map(|overlap| overlap.links).collect(),
            tolerance,
        })
    }

    /// Finds the self-contacts of `frame`, the next of `percepts`, whose touches are there.
    pub(super) fn find(
        &self,
        plan: &Plan,
        links: &Links,
        (frame, restarts): (&Frame, bool),
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
            let is_placed = if field.parts.is_empty() { world.is_some() } else { links.are_posed(frame) };
            if !is_placed {
                percepts.flags[index * plan.fields.len() + number] |= Flags::NO_POSE;
            }
            let Some(link) = self.links[number] else { continue };
            touched = true;
            let Some(world) = world else { continue };
            placed = true;
            sides.extend(percepts.field_touches(index, number).iter().filter_map(|touch| {
                let position = DVec3::from_array(touch.position?);
                let normal = touch.centroid.map(|[u, v]| place::on_skin(field, DVec3::new(u, v, 0.0)).1);
                Some(Side {
                    field: number,
                    touch: touch.id,
                    link,
                    letter: field.letter,
                    total: touch.total,
                    position,
                    normal: normal.map(|normal| world.transform_vector3(normal)),
                })
            }));
        }
        if restarts {
            memory.restart();
        }
        memory.release(|field, id| percepts.field_touches(index, field).iter().any(|touch| touch.id == id));
        let found =
            pairs(&sides, |a, b| self.tolerance.between_m(a, b), |a, b| self.overlaps.contains(&[a.min(b), a.max(b)]));
        let contact = |pair: &crate::stage::self_contacts::Pair| {
            let both = pair.sides.map(|side| &sides[side]);
            let side = |side: &Side| SelfContactSide { field: side.field, touch: side.touch, total: side.total };
            let position = (both[0].position + both[1].position) / 2.0;
            let id = memory.id_of(both);
            SelfContact::new(id, both.map(side), position.to_array(), pair.distance_m, pair.angle_rad)
        };
        let self_contacts: Vec<SelfContact> = found.iter().map(contact).collect();
        percepts.push_self_contacts(self_contacts, placed || !touched);
    }
}

/// By field of `plan`, its link, if its touches can be in contact. Of nested fields on one link that is the coarsest that has
/// a chart, so that a press over several patches is one touch; where none has one, it is those that no other divides.
fn links_in_contact(body: &Body, plan: &Plan) -> Vec<Option<usize>> {
    let parent_of: BTreeMap<&str, &str> =
        body.fields.iter().filter_map(|spec| Some((spec.name.as_str(), spec.parent.as_deref()?))).collect();
    let link_of = |field: &PlanField| {
        let mut taxels = plan.members_of(field).iter().map(|member| plan.channel_of(member.slot as usize));
        let is_on_anchor = |channel: usize| Some(body.taxels[plan.body_taxels[channel]].link) == field.anchor;
        field.anchor.filter(|_| taxels.all(is_on_anchor))
    };
    let charted: BTreeSet<&str> = plan
        .fields
        .iter()
        .filter(|field| field.charted && link_of(field).is_some())
        .map(|field| field.name.as_str())
        .collect();
    let is_coarsest = |field: &&PlanField| {
        let mut above = std::iter::successors(parent_of.get(field.name.as_str()), |parent| parent_of.get(**parent));
        (field.charted || !field.divided) && !above.any(|parent| charted.contains(parent))
    };
    plan.fields.iter().map(|field| Some(field).filter(is_coarsest).and_then(link_of)).collect()
}
