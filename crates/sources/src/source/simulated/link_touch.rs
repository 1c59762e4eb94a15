//! Touches of one link in a simulation: their forces on the taxels, and their truth.

use std::sync::Arc;

use glam::DVec3;

use super::contact::{Footprint, Layer};
use super::setup::Touch;
use super::truth::{Truth, line_angle};
use super::whole_truth::Moment;
use crate::body::{Body, Taxel};
use crate::error::{Error, Result};

/// A touch, and the taxels' (position, normal) in its link's frame.
pub(super) struct LinkTouch {
    pub(super) touch: Touch,
    pub(super) link: String,
    pub(super) taxels: Arc<[(DVec3, DVec3)]>,
}

/// The position and the normal of each of `taxels`, by their indices in `body`, in the frame of `link` at rest.
pub(super) fn places_in(body: &Body, link: usize, taxels: &[(usize, f64)]) -> Arc<[(DVec3, DVec3)]> {
    let place = |&(taxel, _): &(usize, f64)| {
        let taxel: &Taxel = &body.taxels[taxel];
        let link_from_taxel = body.rest_transform(link, taxel.link);
        let normal = link_from_taxel.transform_vector3(taxel.normal_in_link);
        (link_from_taxel.transform_point3(taxel.position_in_link), normal)
    };
    taxels.iter().map(place).collect()
}

impl LinkTouch {
    /// Presses through `layer`, adds what the taxels feel to `forces_newton`, and returns what is true of it. `sides` has by taxel
    /// its index in the body and the side of a square of its area, m.
    pub(super) fn press(
        &self,
        layer: &Layer,
        sides: &[(usize, f64)],
        moment: &Moment,
        forces_newton: &mut [f64],
    ) -> Result<Option<Truth>> {
        let (touch, &Moment { t_s, before_s, .. }) = (&self.touch, moment);
        let Some(force_newton) = touch.force(t_s) else { return Ok(None) };
        let Some(place) = touch.path.place(t_s) else { return Err(Error::failed(touch.leaves_surface(t_s))) };
        let angle = touch.angle.as_ref().map(|angle| angle.held(t_s));
        let along = touch.path.direction(&place, angle.unwrap_or(0.0));
        let across = along.cross(place.normal_in_link);
        let footprint = Footprint::new(&touch.indenter, layer, force_newton);
        for ((force, (position, normal)), (_, side_m)) in forces_newton.iter_mut().zip(self.taxels.iter()).zip(sides) {
            let offset = *position - place.position_in_link;
            if normal.dot(place.normal_in_link) > 0.0 && offset.dot(place.normal_in_link).abs() <= footprint.depth_m() {
                *force += force_newton * footprint.share_on(offset.dot(across), offset.dot(along), *side_m);
            }
        }
        let before = before_s.filter(|&t_s| touch.force(t_s).is_some());
        let before = before.and_then(|before_s| Some((touch.path.place(before_s)?, t_s - before_s)));
        let velocity_in_link = before.map(|(before, dt_s)| (place.position_in_link - before.position_in_link) / dt_s);
        let velocity_uv = before.and_then(|(before, dt_s)| {
            let (now, before) = (place.uv?, before.uv?);
            Some([(now[0] - before[0]) / dt_s, (now[1] - before[1]) / dt_s])
        });
        Ok(Some(Truth {
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
            force_newton,
            direction_in_link: angle.map(|_| along),
            principal_axis_in_link: None,
            depth_m: None,
        }))
    }
}
