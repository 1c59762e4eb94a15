//! Touches of the whole body in a simulation: their forces on the taxels, and their truth in the frames of links.

use glam::DVec3;

use super::contact::Layer;
use super::drag::Drag;
use super::friction::Pull;
use super::truth::{Truth, line_angle};
use super::whole::{BodySkin, BodyTouch, Contact};
use super::whole_setup::leaves_skin;
use crate::body::Body;
use crate::error::{Error, Result};
use crate::field::default_u;

/// A touch of the whole body, and where its indenters were last.
pub(super) struct TouchOfBody {
    pub(super) touch: BodyTouch,
    /// Its friction, if that is felt.
    drag: Option<Drag>,
    /// The frame, and the place of each indenter at rest.
    last: Option<(u64, Vec<DVec3>)>,
    /// What is to be said of it, if that has not been said.
    notice: Option<String>,
    is_noticed: bool,
}

/// A frame that is read.
pub(super) struct Moment {
    /// The touch's place in the file, from 0.
    pub(super) touch: usize,
    pub(super) frame: u64,
    pub(super) t_s: f64,
    /// Of the frame before, if there is one.
    pub(super) before_s: Option<f64>,
}

impl TouchOfBody {
    pub(super) fn new(touch: BodyTouch, drag: Option<Drag>) -> Self {
        Self { touch, drag, last: None, notice: None, is_noticed: false }
    }

    /// μ, if it has friction that is felt.
    pub(super) fn friction(&self) -> Option<f64> {
        self.drag.as_ref().map(Drag::coefficient)
    }

    /// That it does not reach its place, once.
    pub(super) fn take_notice(&mut self) -> Option<String> {
        self.notice.take()
    }

    /// Lets go of the skin.
    pub(super) fn rest(&mut self) {
        self.drag.iter_mut().for_each(Drag::release);
    }

    /// Presses through `layer`, adds what the taxels feel to `forces_newton` and `pulls_newton`, and returns what is true of each
    /// indenter.
    pub(super) fn press(
        &mut self,
        body: &Body,
        (skin, layer): (&BodySkin, &Layer),
        moment: &Moment,
        (forces_newton, pulls_newton): (&mut [f64], &mut [[f64; 2]]),
    ) -> Result<Vec<Truth>> {
        let (touch, &Moment { frame, t_s, before_s, .. }) = (&self.touch, moment);
        let Some(force_newton) = touch.force(t_s) else {
            self.rest();
            return Ok(Vec::new());
        };
        let off = |t_s: f64| Error::failed(format!("touch `{}`: {}", touch.name, leaves_skin(t_s)));
        let force = (force_newton, self.drag.is_some());
        let contacts = touch.press(skin, t_s, force, forces_newton).ok_or_else(|| off(t_s))?;
        if let Some(notice) = contacts.iter().find_map(|contact| unreached(body, &touch.name, t_s, contact))
            && !std::mem::replace(&mut self.is_noticed, true)
        {
            self.notice = Some(notice);
        }
        let drag = self.drag.as_mut();
        let pulls = drag.map(|drag| drag.pull((skin, layer), t_s, &contacts, pulls_newton));
        let places = |contacts: &[Contact]| contacts.iter().map(|contact| contact.position).collect::<Vec<DVec3>>();
        let known = self.last.take().filter(|(number, _)| number + 1 == frame).map(|(_, places)| places);
        // Frames may be read in any order.
        let before = match (known, before_s.and_then(|before_s| Some((before_s, touch.force(before_s)?)))) {
            (None, Some((before_s, force))) => {
                let mut unfelt = vec![0.0; forces_newton.len()];
                let before = touch.press(skin, before_s, (force, false), &mut unfelt).ok_or_else(|| off(before_s))?;
                Some(places(&before))
            }
            (known, _) => known,
        };
        self.last = Some((frame, places(&contacts)));
        let of_indenter = |(number, contact): (usize, &Contact)| {
            let moved = before.as_ref().map(|places| contact.position - places[number]);
            let name = match (contacts.len(), number) {
                (1, _) => touch.name.clone(),
                (_, 0) => format!("{} (first)", touch.name),
                _ => format!("{} (second)", touch.name),
            };
            let velocity = moved.zip(before_s).map(|(moved, before_s)| moved / (t_s - before_s));
            let pull = pulls.as_ref().map(|pulls| pulls[number]);
            truth(body, (moment.touch, name), contact, velocity, pull)
        };
        Ok(contacts.iter().enumerate().map(of_indenter).collect())
    }
}

/// The message that `contact` is not at its place at `t_s`, if so.
fn unreached(body: &Body, touch: &str, t_s: f64, contact: &Contact) -> Option<String> {
    let link = contact.unreached?;
    let [wanted, met] = [link, contact.link].map(|link| &body.links[link].name);
    let met = if link == contact.link { "another part of it".to_owned() } else { format!("`{met}`") };
    let above_mm = -contact.depth_m * 1e3;
    Some(format!(
        "touch `{touch}` does not reach its place on `{wanted}` at {t_s:.3} s: it stays at least {above_mm:.1} mm above, as {met} is in \
         the way; take a smaller indenter, or another `path`"
    ))
}

/// The truth of `contact`, which moves with `velocity` on the body at rest, and does `pull` along the skin.
fn truth(
    body: &Body,
    (touch, name): (usize, String),
    contact: &Contact,
    velocity: Option<DVec3>,
    pull: Option<Pull>,
) -> Truth {
    let link = &body.links[contact.link];
    let link_from_body = link.body_from_link.inverse();
    let turned = |vector: DVec3| link_from_body.transform_vector3(vector);
    let normal_in_link = turned(contact.normal);
    let direction_in_link = contact.direction.map(turned);
    let u = default_u(normal_in_link);
    let u = (u - normal_in_link * u.dot(normal_in_link)).normalize_or(u);
    let angle = direction_in_link.map(|d| libm::atan2(d.dot(normal_in_link.cross(u)), d.dot(u)));
    Truth {
        touch,
        name,
        link: link.name.clone(),
        field: None,
        position_in_link: link_from_body.transform_point3(contact.position),
        normal_in_link,
        uv: None,
        angle: angle.map(line_angle),
        velocity_in_link: velocity.map(turned),
        velocity_uv: None,
        speed: velocity.map(DVec3::length),
        force_newton: contact.force_newton,
        direction_in_link,
        principal_axis_in_link: contact.principal_axis.map(turned),
        depth_m: Some(contact.depth_m),
        shear_in_link: pull.map(|pull| turned(pull.newton)),
        shear_uv: None,
        torsion: pull.map(|pull| pull.torsion),
        slips: pull.map(|pull| pull.slips),
        gap_m: None,
        celsius: None,
    }
}
