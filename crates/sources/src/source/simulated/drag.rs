//! What touches of the whole body do along the skin: each indenter of a touch holds the skin on its own.

use glam::DVec3;

use super::contact::Layer;
use super::friction::{self, Friction, Grip, Pull, Pulled, Stand};
use super::profile::Profile;
use super::senses_setup::Beside;
use super::whole::{BodySkin, Contact, carried};

/// The friction of a touch.
pub(super) struct Drag {
    friction: Friction,
    /// rad, of a round indenter.
    twist: Option<Profile>,
    /// Whether it turns by the way that it faces.
    is_long: bool,
    /// Of each indenter.
    each: Vec<Held>,
}

/// How an indenter holds the skin.
struct Held {
    friction: Friction,
    /// The normal, the way that it faced, and how far it had turned, rad.
    last: Option<(DVec3, DVec3, f64)>,
}

impl Drag {
    /// Of a touch by `beside`, if it has friction.
    pub(super) fn new(beside: Beside, is_long: bool) -> Option<Self> {
        let Beside { friction, twist, .. } = beside;
        friction.map(|friction| Self { friction, twist, is_long, each: Vec::new() })
    }

    /// μ
    pub(super) fn coefficient(&self) -> f64 {
        self.friction.coefficient()
    }

    /// Lets go of the skin.
    pub(super) fn release(&mut self) {
        self.each.clear();
    }

    /// Pulls at `skin` under `layer` at `t_s` with `contacts`, which have their forces, and adds what taxels feel along their tangents to
    /// `felt`; what each does.
    pub(super) fn pull(
        &mut self,
        (skin, layer): (&BodySkin, &Layer),
        t_s: f64,
        contacts: &[Contact],
        felt: &mut [[f64; 2]],
    ) -> Vec<Pull> {
        let Self { friction, twist, is_long, each } = self;
        each.resize_with(contacts.len(), || Held { friction: friction.clone(), last: None });
        let twisted = twist.as_ref().map_or(0.0, |twist| twist.held(t_s));
        let pull = |(contact, held): (&Contact, &mut Held)| {
            let turned = if *is_long { held.turned(contact) } else { twisted };
            let stand = Stand { position: contact.stands_at, normal: contact.normal, turned };
            let grip = Grip {
                force_newton: contact.force_newton,
                radius_m: contact.radius_m,
                stiffness_pa: layer.stiffness_pa,
            };
            let pull = held.friction.move_to(stand, &grip);
            let pulled = contact.forces_newton.iter().map(|&(taxel, force_newton)| Pulled {
                taxel,
                offset: skin.position(taxel) - contact.position,
                force_newton,
            });
            let pulled: Vec<Pulled> = pulled.collect();
            friction::spread(&pull, contact.normal, contact.force_newton, &pulled, |taxel| skin.axes(taxel), felt);
            pull
        };
        contacts.iter().zip(each).map(pull).collect()
    }
}

impl Held {
    /// How far it has turned about the normal since it took hold, rad: what is left of the way that it faces when the normal
    /// takes that along.
    fn turned(&mut self, contact: &Contact) -> f64 {
        let (normal, along) = (contact.normal, contact.along);
        let turned = self.last.map_or(0.0, |(before, faced, turned)| {
            let faced = carried(faced, before, normal);
            turned + libm::atan2(faced.cross(along).dot(normal), faced.dot(along))
        });
        self.last = Some((normal, along, turned));
        turned
    }
}
