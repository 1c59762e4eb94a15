//! Contacts that are fitted to touches of the whole body, as they are compared: with each other, and with what presses a field.

use glam::DVec3;

use crate::engine::Engine;
use crate::percept::{Touch, TouchFit, TouchFlags, TouchFrame, TouchOutputs};
use crate::touch;

/// What is asked of touches whose fits are compared.
pub(super) fn asked() -> touch::Options {
    let outputs = TouchOutputs::FIELDS | TouchOutputs::FIT_PLACE | TouchOutputs::FIT_DIRECTION;
    touch::Options { outputs, ..touch::Options::default() }
}

/// The touches that two frames share, if both have a fit.
pub(super) fn shared<'a>(
    one: &'a TouchFrame,
    other: &'a TouchFrame,
) -> impl Iterator<Item = (&'a TouchFit, &'a TouchFit)> {
    one.touches.iter().filter_map(|touch| {
        let same = other.touches.iter().find(|same| same.id == touch.id)?;
        touch.fit.as_ref().zip(same.fit.as_ref())
    })
}

/// The touch among those `found` that has most pressure on `field`.
pub(super) fn touch_on(found: &TouchFrame, field: usize) -> Option<&Touch> {
    let on_field =
        |touch: &Touch| found.fields(touch).iter().find(|share| share.field as usize == field).map(|share| share.total);
    let on_field = found.touches.iter().filter_map(|touch| Some((on_field(touch)?, touch)));
    on_field.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, touch)| touch)
}

/// A fit on a link.
#[derive(Clone, Copy, Debug)]
pub(super) struct FitOnLink {
    /// Its place, m.
    pub(super) place: DVec3,
    /// Unit vector along it; none for a point.
    pub(super) direction: Option<DVec3>,
}

impl FitOnLink {
    /// The fit of `touch` as it lies on `link` while the body of `engine` rests; it is given in the touch's own link.
    pub(super) fn new(engine: &Engine, touch: &Touch, link: u32) -> Option<Self> {
        // What doubts itself is not an answer to trade speed for.
        let is_counted = !touch.flags.intersects(TouchFlags::POOR_FIT | TouchFlags::FEW_TAXELS);
        let (skin, fit) = (engine.skin()?, touch.fit.filter(|_| is_counted)?);
        let link_from_own = skin.link_from_body(link) * skin.link_from_body(touch.link).inverse();
        Some(Self {
            place: link_from_own.transform_point3(fit.place),
            direction: fit.direction.map(|direction| link_from_own.transform_vector3(direction)),
        })
    }
}
