//! Touches of one link in a simulation: what they do to the taxels, and their truth.

use std::sync::Arc;

use glam::DVec3;

use super::contact::{Footprint, Layer};
use super::friction::{self, Grip, Pull, Pulled, Stand};
use super::nearness::Solid;
use super::path::ContactPoint;
use super::senses::Sensed;
use super::senses_setup::Beside;
use super::setup::Touch;
use super::truth::{Truth, line_angle};
use super::whole_truth::Moment;
use crate::body::{Body, Taxel};
use crate::error::{Error, Result};

/// A touch, and where the taxels are in its link's frame.
pub(super) struct LinkTouch {
    pub(super) touch: Touch,
    pub(super) beside: Beside,
    pub(super) link: String,
    pub(super) places: Arc<Places>,
}

/// Taxels in a link's frame at rest.
pub(super) struct Places {
    pressed: Vec<Seat>,
    /// Of the pressed taxels, where any has three axes.
    tangents: Vec<[DVec3; 2]>,
    warm: Vec<Seat>,
    near: Vec<Seat>,
}

struct Seat {
    position: DVec3,
    normal: DVec3,
    /// Whether it is on a link that the touch presses: others are seen, but do not feel it.
    is_touched: bool,
}

/// The taxels of a body by what they measure: indices in the body, and sides of squares of their areas, m.
#[derive(Clone, Copy)]
pub(super) struct Kinds<'a> {
    pub(super) pressed: &'a [(usize, f64)],
    pub(super) warm: &'a [(usize, f64)],
    pub(super) near: &'a [(usize, f64)],
    /// Whether pressed ones have three axes.
    pub(super) has_pulls: bool,
}

/// What sensors feel in a frame.
pub(super) struct Felt<'a> {
    /// By pressed taxel, N.
    pub(super) forces_newton: &'a mut [f64],
    /// The same along its tangents; empty where no taxel has three axes.
    pub(super) pulls_newton: &'a mut [[f64; 2]],
    pub(super) sensed: &'a mut Sensed,
}

impl Places {
    /// The taxels `of` `body` in the frame of `link`, for touches that press the links `pressed`.
    pub(super) fn new(body: &Body, link: usize, pressed: &[usize], of: Kinds<'_>) -> Self {
        let place = |&(taxel, _): &(usize, f64)| {
            let taxel: &Taxel = &body.taxels[taxel];
            let link_from_taxel = body.rest_transform(link, taxel.link);
            Seat {
                position: link_from_taxel.transform_point3(taxel.position_in_link),
                normal: link_from_taxel.transform_vector3(taxel.normal_in_link),
                is_touched: pressed.contains(&taxel.link),
            }
        };
        let tangents = |&(taxel, _): &(usize, f64)| {
            let taxel: &Taxel = &body.taxels[taxel];
            let link_from_taxel = body.rest_transform(link, taxel.link);
            taxel.tangents_in_link().map(|tangent| link_from_taxel.transform_vector3(tangent))
        };
        Self {
            pressed: of.pressed.iter().map(place).collect(),
            tangents: if of.has_pulls { of.pressed.iter().map(tangents).collect() } else { Vec::new() },
            warm: of.warm.iter().map(place).collect(),
            near: of.near.iter().map(place).collect(),
        }
    }
}

/// A touch that presses: where, along which direction, and what of it a place feels.
struct Press<'a> {
    place: &'a ContactPoint,
    along: DVec3,
    across: DVec3,
    footprint: Footprint,
    force_newton: f64,
}

impl Press<'_> {
    /// The share of the force on a square with sides of `side_m` at `seat`; `None` if it is not under the indenter.
    fn share_on(&self, seat: &Seat, side_m: f64) -> Option<f64> {
        let (offset, up) = (seat.position - self.place.position_in_link, self.place.normal_in_link);
        let is_under = seat.is_touched && seat.normal.dot(up) > 0.0 && offset.dot(up).abs() <= self.footprint.depth_m();
        is_under.then(|| self.footprint.share_on(offset.dot(self.across), offset.dot(self.along), side_m))
    }
}

impl LinkTouch {
    /// Forgets what the indenter holds.
    pub(super) fn rest(&mut self) {
        if let Some(friction) = &mut self.beside.friction {
            friction.release();
        }
    }

    /// Presses through `layer`, adds what the taxels `of` the body feel to `felt`, and returns what is true of it.
    pub(super) fn press(
        &mut self,
        layer: &Layer,
        of: Kinds<'_>,
        moment: &Moment,
        felt: &mut Felt<'_>,
    ) -> Result<Option<Truth>> {
        let (touch, &Moment { t_s, before_s, .. }) = (&self.touch, moment);
        let (force_newton, gap_m) = (touch.force(t_s), touch.gap(t_s));
        if !touch.is_there(t_s) {
            self.rest();
            return Ok(None);
        }
        let Some(place) = touch.path.place(t_s) else { return Err(Error::failed(touch.leaves_surface(t_s))) };
        let angle = touch.angle.as_ref().map(|angle| angle.held(t_s));
        let along = touch.path.direction(&place, angle.unwrap_or(0.0));
        let across = along.cross(place.normal_in_link);
        if let Some(gap_m) = gap_m {
            let solid = Solid::new(&touch.indenter, place.position_in_link, place.normal_in_link, along, gap_m);
            for (distance, seat) in felt.sensed.distances_m.iter_mut().zip(&self.places.near) {
                *distance = solid.seen_from(seat.position, seat.normal).map_or(*distance, |seen| distance.min(seen));
            }
        }
        let before = before_s.filter(|&t_s| touch.is_there(t_s));
        let before = before.and_then(|before_s| Some((touch.path.place(before_s)?, t_s - before_s)));
        let velocity_in_link = before.map(|(before, dt_s)| (place.position_in_link - before.position_in_link) / dt_s);
        let velocity_uv = before.and_then(|(before, dt_s)| {
            let (now, before) = (place.uv?, before.uv?);
            Some([(now[0] - before[0]) / dt_s, (now[1] - before[1]) / dt_s])
        });
        let mut truth = Truth {
            touch: moment.touch,
            name: touch.name.clone(),
            link: self.link.clone(),
            field: touch.field.clone(),
            position_in_link: place.position_in_link,
            normal_in_link: place.normal_in_link,
            uv: place.uv,
            angle: angle.map(line_angle),
            velocity_in_link,
            velocity_uv,
            speed: velocity_in_link.map(DVec3::length),
            force_newton: force_newton.unwrap_or(0.0),
            direction_in_link: angle.map(|_| along),
            principal_axis_in_link: None,
            depth_m: None,
            shear_in_link: None,
            shear_uv: None,
            torsion: None,
            slips: None,
            gap_m,
            celsius: self.beside.celsius,
        };
        match force_newton {
            Some(force_newton) => {
                let footprint = Footprint::new(&touch.indenter, layer, force_newton);
                let press = Press { place: &place, along, across, footprint, force_newton };
                let pulled = self.push(&press, of, felt);
                if let Some(pull) = self.pull(&press, layer, angle, t_s, &pulled, felt) {
                    truth.shear_in_link = Some(pull.newton);
                    truth.shear_uv = self.touch.path.in_chart(&place, pull.newton);
                    (truth.torsion, truth.slips) = (Some(pull.torsion), Some(pull.slips));
                }
            }
            None => self.rest(),
        }
        Ok(Some(truth))
    }

    /// Adds the forces along the normals and the warmth; returns the taxels that feel a force, if they can be pulled.
    fn push(&self, press: &Press<'_>, of: Kinds<'_>, felt: &mut Felt<'_>) -> Vec<Pulled> {
        let mut pulled = Vec::new();
        let taxels = felt.forces_newton.iter_mut().zip(&self.places.pressed).zip(of.pressed).enumerate();
        for (taxel, ((force, seat), &(_, side_m))) in taxels {
            let Some(share) = press.share_on(seat, side_m) else { continue };
            let force_newton = press.force_newton * share;
            *force += force_newton;
            if of.has_pulls && force_newton > 0.0 {
                pulled.push(Pulled { taxel, offset: seat.position - press.place.position_in_link, force_newton });
            }
        }
        if let Some(celsius) = self.beside.celsius {
            for ((warmed, seat), &(_, side_m)) in felt.sensed.warmed.iter_mut().zip(&self.places.warm).zip(of.warm) {
                let Some(share) = press.share_on(seat, side_m) else { continue };
                let share = (share / press.footprint.share_on(0.0, 0.0, side_m)).min(1.0);
                warmed[0] += share;
                warmed[1] += share * celsius;
            }
        }
        pulled
    }

    /// Pulls along the skin; how, if the touch has friction and taxels feel it.
    fn pull(
        &mut self,
        press: &Press<'_>,
        layer: &Layer,
        angle: Option<f64>,
        t_s: f64,
        pulled: &[Pulled],
        felt: &mut Felt<'_>,
    ) -> Option<Pull> {
        if felt.pulls_newton.is_empty() {
            return None;
        }
        let friction = self.beside.friction.as_mut()?;
        let twist = self.beside.twist.as_ref().map(|twist| twist.held(t_s));
        let normal = press.place.normal_in_link;
        let turned = angle.or(twist).unwrap_or(0.0);
        let grip = Grip {
            force_newton: press.force_newton,
            radius_m: press.footprint.radius_m(),
            stiffness_pa: layer.stiffness_pa,
        };
        let stand = Stand { position: press.place.position_in_link, normal, turned };
        let pull = friction.move_to(stand, &grip);
        let axes = |taxel: usize| (self.places.pressed[taxel].normal, self.places.tangents[taxel]);
        friction::spread(&pull, normal, press.force_newton, pulled, axes, felt.pulls_newton);
        Some(pull)
    }
}
