//! The touches of a simulation.

use std::collections::BTreeMap;
use std::sync::Arc;

use toml::Spanned;

use super::contact::Layer;
use super::drag::Drag;
use super::file::TouchKeys;
use super::friction::Friction;
use super::link_touch::{Felt, Kinds, LinkTouch, Places};
use super::setup::Setup;
use super::truth::Truth;
use super::whole::{BodySkin, Covers};
use super::whole_setup;
use super::whole_truth::{Moment, TouchOfBody};
use crate::body::Body;
use crate::error::Result;

/// A touch of one link, or of the whole body.
pub(super) enum Pressing {
    Link(Box<LinkTouch>),
    Body(Box<TouchOfBody>),
}

/// What becomes of a touch that the body has no place for.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum WrongTouch {
    Refuse,
    LeaveOut,
}

/// All touches, and the skin of the whole body if any presses that.
pub(super) struct Touches {
    pub(super) all: Vec<Pressing>,
    pub(super) body_skin: Option<Arc<BodySkin>>,
}

impl Touches {
    /// Those of `keys`, through `layer` on the taxels `of` the body.
    pub(super) fn new(
        setup: &mut Setup<'_>,
        keys: &[Spanned<TouchKeys>],
        layer: &Layer,
        of: Kinds<'_>,
        covers: Covers,
        wrong: WrongTouch,
    ) -> Result<Self> {
        let body = setup.body;
        let mut all = Vec::with_capacity(keys.len());
        let mut places = BTreeMap::new();
        let mut body_skin = None;
        for (index, keys) in keys.iter().enumerate() {
            if whole_setup::is_of_body(keys.get_ref()) {
                let make = || BodySkin::new(body, layer, of.pressed, covers);
                let touch = match (setup.body_touch(index, keys.get_ref(), layer, &mut body_skin, make), wrong) {
                    (Err(_), WrongTouch::LeaveOut) => continue,
                    (touch, _) => touch?,
                };
                let is_long = touch.tool.is_long();
                let drag = Drag::new(setup.beside(keys.get_ref(), layer, is_long)?, is_long);
                let drag = drag.filter(|_| of.has_pulls);
                all.push(Pressing::Body(Box::new(TouchOfBody::new(touch, drag))));
                continue;
            }
            let touch = match (setup.touch(index, keys.get_ref()), wrong) {
                (Err(_), WrongTouch::LeaveOut) => continue,
                (touch, _) => touch?,
            };
            let in_link = || Arc::new(Places::new(body, touch.link, &touch.pressed, of));
            let places = places.entry((touch.link, touch.pressed.clone())).or_insert_with(in_link);
            let places = Arc::clone(places);
            let link = body.links[touch.link].name.clone();
            let beside = setup.beside(keys.get_ref(), layer, touch.indenter.is_long())?;
            all.push(Pressing::Link(Box::new(LinkTouch { touch, beside, link, places })));
        }
        Ok(Self { all, body_skin })
    }

    /// The μ of all touches that have one, if it is the same.
    pub(super) fn friction(&self) -> Option<f64> {
        let of_touch = |touch: &Pressing| match touch {
            Pressing::Link(touch) => touch.beside.friction.as_ref().map(Friction::coefficient),
            Pressing::Body(touch) => touch.friction(),
        };
        let mut all = self.all.iter().filter_map(of_touch);
        let first = all.next()?;
        all.all(|other| other == first).then_some(first)
    }

    /// What is to be said of them since the last call.
    pub(super) fn notices(&mut self) -> impl Iterator<Item = String> {
        self.all.iter_mut().filter_map(|touch| match touch {
            Pressing::Link(_) => None,
            Pressing::Body(touch) => touch.take_notice(),
        })
    }

    /// Forgets what indenters hold.
    pub(super) fn rest(&mut self) {
        for touch in &mut self.all {
            match touch {
                Pressing::Link(touch) => touch.rest(),
                Pressing::Body(touch) => touch.rest(),
            }
        }
    }

    /// Adds what the taxels `of` `body` feel of all of them, pressed through `layer`, to `felt`, and what is true of them to
    /// `truth`. `moment` is that of the first.
    pub(super) fn press(
        &mut self,
        body: &Body,
        layer: &Layer,
        of: Kinds<'_>,
        moment: &Moment,
        (felt, truth): (&mut Felt<'_>, &mut Vec<Truth>),
    ) -> Result<()> {
        for (number, touch) in self.all.iter_mut().enumerate() {
            let moment = Moment { touch: number, ..*moment };
            match touch {
                Pressing::Link(touch) => truth.extend(touch.press(layer, of, &moment, felt)?),
                Pressing::Body(touch) => {
                    let Some(skin) = &self.body_skin else { continue };
                    truth.extend(touch.press(
                        body,
                        (skin, layer),
                        &moment,
                        (&mut *felt.forces_newton, &mut *felt.pulls_newton),
                    )?);
                }
            }
        }
        Ok(())
    }
}
