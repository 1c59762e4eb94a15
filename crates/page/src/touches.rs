//! Touches of the whole body as frames carry them.

use glam::DVec3;

use super::encode::{Writer, no_link};
use crate::body::Body;
use somatic_engine::percept::{Touch, TouchFrame, TouchTrails};
use somatic_engine::scene::Plan;

/// How a page counts and places what touches name.
#[derive(Clone, Debug)]
pub(super) struct TouchPlaces {
    /// By node of the skin, the taxel among the body's.
    taxels: Vec<u32>,
    /// The link that stands for the world, where one does.
    world: Option<usize>,
    /// What places in the world are relative to, m.
    origin: DVec3,
}

impl TouchPlaces {
    /// Of touches of `body` under `plan`.
    pub(super) fn new(body: &Body, plan: &Plan, origin: DVec3) -> Self {
        let of_skin = body.taxels.iter().zip(0..).filter(|(taxel, _)| taxel.modality.is_pressed());
        Self {
            taxels: of_skin.map(|(_, index)| index).collect(),
            world: plan.relative_to().and_then(|link| body.link_index(link)),
            origin,
        }
    }

    /// The section of a frame at `t_s` that holds what is `found`, with its `trails`.
    pub(super) fn write(&self, to: &mut Writer, found: &TouchFrame, trails: &TouchTrails, t_s: f64) {
        for touch in &found.touches {
            self.write_one(to, found, touch, (trails, t_s));
        }
        to.pad();
    }

    fn write_one(&self, to: &mut Writer, found: &TouchFrame, touch: &Touch, (trails, t_s): (&TouchTrails, f64)) {
        let (taxels, links, fields) = (found.taxels(touch), found.links(touch), found.fields(touch));
        let link = (!touch.in_world).then_some(touch.link);
        let trail_points = trails.trail(touch.id).count();
        to.u32(touch.id as u32);
        to.u32(touch.link);
        to.u32(self.frame(link));
        to.u32(touch.flags.bits());
        to.u32(touch.active);
        for count in [taxels.len(), links.len(), fields.len(), trail_points] {
            to.u32(count as u32);
        }
        to.f32(touch.age_s as f32);
        to.f32(touch.total as f32);
        number(to, touch.force_newton);
        to.f32(touch.peak as f32);
        number(to, touch.anisotropy);
        self.place(to, link, touch.position);
        vector(to, Some(touch.normal));
        vector(to, touch.principal_axis);
        let [along, across] = touch.spread_m.map_or([None; 2], |spread| spread.map(Some));
        number(to, along);
        number(to, across);
        vector(to, touch.velocity);
        match touch.place {
            Some(place) => self.place(to, link, place),
            None => vector(to, None),
        }
        let [along_u, along_v] = touch.place_sigma_m.map_or([None; 2], |sigma| sigma.map(Some));
        number(to, along_u);
        number(to, along_v);
        for &node in taxels {
            to.u32(self.taxels[node as usize]);
        }
        let share = |total: f64| (total / touch.total) as f32;
        for part in links {
            to.u32(part.link);
            to.f32(share(part.total));
        }
        for part in fields {
            to.u32(part.field);
            to.f32(share(part.total));
        }
        for point in trails.trail(touch.id) {
            to.f32((t_s - point.t_s) as f32);
            to.u32(self.frame(point.link));
            self.place(to, point.link, point.position);
        }
    }

    /// The link in whose frame places are that are in that of `link`, or in the world.
    fn frame(&self, link: Option<u32>) -> u32 {
        link.unwrap_or(no_link(self.world))
    }

    fn place(&self, to: &mut Writer, link: Option<u32>, position: DVec3) {
        let is_of_world = link.is_none() && self.world.is_none();
        let from = if is_of_world { self.origin } else { DVec3::ZERO };
        vector(to, Some(position - from));
    }
}

fn number(to: &mut Writer, number: Option<f64>) {
    to.f32(number.map_or(f32::NAN, |number| number as f32));
}

fn vector(to: &mut Writer, vector: Option<DVec3>) {
    let components = vector.map_or([f32::NAN; 3], |vector| vector.as_vec3().to_array());
    components.into_iter().for_each(|component| to.f32(component));
}
