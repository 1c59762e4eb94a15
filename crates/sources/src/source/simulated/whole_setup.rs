//! Builds the touches of a whole body from their keys.

use std::sync::Arc;

use glam::DVec3;
use toml::Spanned;

use super::contact::Layer;
use super::file::{CoversName, IndenterName, SensorKeys, TouchKeys, WaypointKeys};
use super::profile::Profile;
use super::setup::Setup;
use super::whole::{BodyPath, BodySkin, BodyTouch, Covers, Shape, Tool, Waypoint};
use crate::error::Result;
use crate::keys::Text;

/// How a touch names the whole body.
const WHOLE: &str = "body";
/// Maximum length of an indenter, m.
const MAX_LENGTH_M: f64 = 1.0;

/// Whether `keys` are of a touch of the whole body: a link or a field may have the same name.
pub(super) fn is_of_body(keys: &TouchKeys) -> bool {
    let of_body = |place: &Spanned<WaypointKeys>| !matches!(place.get_ref(), WaypointKeys::Numbers(_));
    keys.on.get_ref() == WHOLE && keys.path.get_ref().iter().any(of_body)
}

/// What taxels feel of touches of the whole body.
pub(super) fn covers(text: Text<'_>, keys: &SensorKeys) -> Result<Covers> {
    match keys.covers.as_ref().map(|covers| (*covers.get_ref(), covers.span())) {
        Some((CoversName::Cell, at)) if keys.area_m2.is_some() => {
            Err(text.wrong(at, "`covers` is cell; with `area_m2` it must be area"))
        }
        Some((CoversName::Cell, _)) => Ok(Covers::Cell),
        None if keys.area_m2.is_none() => Ok(Covers::Cell),
        Some((CoversName::Area, _)) | None => Ok(Covers::Area),
    }
}

impl Setup<'_> {
    /// The touch number `index` of the whole body; `skin` is made for the first one.
    pub(super) fn body_touch(
        &self,
        index: usize,
        keys: &TouchKeys,
        layer: &Layer,
        skin: &mut Option<Arc<BodySkin>>,
        make: impl FnOnce() -> BodySkin,
    ) -> Result<BodyTouch> {
        let text = self.text;
        self.only_drags(keys)?;
        if layer.thickness_m <= 0.0 {
            let what = "`on` is body, which needs a layer that gives way; give [layer] its `thickness_m`";
            return Err(text.wrong(keys.on.span(), what));
        }
        let tool = self.tool(keys)?;
        let skin = skin.get_or_insert_with(|| Arc::new(make()));
        let mut waypoints = Vec::new();
        for place in keys.path.get_ref() {
            waypoints.push(self.body_place(skin, place)?);
        }
        let Some((_, link)) = waypoints.first().copied() else {
            return Err(text.wrong(keys.path.span(), "`path` is empty; give at least one place"));
        };
        let waypoints: Vec<Waypoint> = waypoints.into_iter().map(|(waypoint, _)| waypoint).collect();
        let positions: Vec<DVec3> = waypoints.iter().map(|waypoint| waypoint.position).collect();
        let times_s = self.times(keys, &positions)?;
        let touch = BodyTouch {
            name: keys.name.clone().unwrap_or_else(|| format!("touch {}", index + 1)),
            tool,
            angle: self.angle(keys, tool.is_long())?.unwrap_or_else(|| Profile::constant(0.0)),
            path: BodyPath { waypoints, times_s, body_from_link: self.body.links[link].body_from_link },
            force_newton: self.force(keys)?,
        };
        match touch.leaves_skin(skin, self.duration_s) {
            Some(t_s) => Err(text.wrong(keys.path.span(), leaves_skin(t_s))),
            None => Ok(touch),
        }
    }

    /// A place of the path on the skin, and its link.
    fn body_place(&self, skin: &BodySkin, place: &Spanned<WaypointKeys>) -> Result<(Waypoint, usize)> {
        let wrong = |what: String| Err(self.text.wrong(place.span(), what));
        let (link, position, normal) = match place.get_ref() {
            WaypointKeys::Numbers(_) => {
                let what = "on = \"body\" needs a `path` of { taxel = ID } or { link = \"NAME\", at = [x, y, z] }";
                return wrong(what.to_owned());
            }
            WaypointKeys::Taxel { taxel } => {
                let index = u32::try_from(*taxel).ok().and_then(|id| self.body.taxel_index(id));
                let Some(taxel) = index.map(|index| &self.body.taxels[index]) else {
                    return wrong(format!("the body has no taxel {taxel}"));
                };
                (taxel.link, taxel.position_in_link, Some(taxel.normal_in_link))
            }
            WaypointKeys::Place { link, at } => {
                let Some(index) = self.body.link_index(link) else {
                    let named = Spanned::new(place.span(), link.clone());
                    return Err(self.text.unknown(&named, "link", self.body.links.iter().map(|l| l.name.as_str())));
                };
                if let Some(bad) = at.iter().find(|x| x.is_nan() || x.abs() > 1e6) {
                    return wrong(format!("`path` has the coordinate {bad}; give metres"));
                }
                (index, DVec3::from_array(*at), None)
            }
        };
        let rest = self.body.links[link].body_from_link;
        let outward = normal.map(|normal| rest.transform_vector3(normal));
        match skin.waypoint(rest.transform_point3(position), outward) {
            Some(waypoint) => Ok((waypoint, link)),
            None => wrong("`path` has a place over 20 mm from the body's surface; put it on the surface".to_owned()),
        }
    }

    fn tool(&self, keys: &TouchKeys) -> Result<Tool> {
        let (text, indenter) = (self.text, &keys.indenter);
        let size = |key: &str, value: &Option<Spanned<f64>>| match value {
            Some(value) => {
                let metres = text.positive(key, value)?;
                let fits = metres <= MAX_LENGTH_M;
                let what = || format!("`{key}` is {metres}; on = \"body\" takes up to {MAX_LENGTH_M} m");
                if fits { Ok(metres) } else { Err(text.wrong(value.span(), what())) }
            }
            None => Err(text.wrong(indenter.span(), format!("this indenter needs its `{key}`"))),
        };
        let all = [
            ("radius_m", &keys.radius_m),
            ("length_m", &keys.length_m),
            ("width_m", &keys.width_m),
            ("apart_m", &keys.apart_m),
            ("aspect", &keys.aspect),
        ];
        let only = |wanted: &[&str]| {
            let beside = all.iter().filter(|(key, _)| !wanted.contains(key));
            let mut beside = beside.map(|(key, value)| text.refuse(key, value.as_ref(), "for this indenter"));
            beside.find(Result::is_err).unwrap_or(Ok(()))
        };
        if *indenter.get_ref() != IndenterName::Ellipsoid {
            text.refuse("radii_m", keys.radii_m.as_ref(), "for this indenter")?;
        }
        let (radius, length) = (|| size("radius_m", &keys.radius_m), || size("length_m", &keys.length_m));
        Ok(match indenter.get_ref() {
            IndenterName::Ball => {
                only(&["radius_m"])?;
                Tool::One(Shape::Ball { radius_m: radius()? })
            }
            IndenterName::Rod => {
                only(&["radius_m", "length_m"])?;
                Tool::One(Shape::Rod { radius_m: radius()?, length_m: length()? })
            }
            IndenterName::Strap => {
                only(&["width_m", "length_m"])?;
                Tool::One(Shape::Strap { width_m: size("width_m", &keys.width_m)?, length_m: length()? })
            }
            IndenterName::Pair => {
                only(&["radius_m", "apart_m"])?;
                let shape = Shape::Ball { radius_m: radius()? };
                Tool::Pair { shape, apart_m: size("apart_m", &keys.apart_m)? }
            }
            IndenterName::Ellipsoid => {
                only(&[])?;
                let Some(radii) = &keys.radii_m else {
                    return Err(text.wrong(indenter.span(), "this indenter needs its `radii_m`"));
                };
                if !radii.get_ref().iter().all(|radius| *radius > 0.0 && *radius <= MAX_LENGTH_M) {
                    let what = "`radii_m` is three lengths over 0 and up to 1 m: along, across and along the normal";
                    return Err(text.wrong(radii.span(), what));
                }
                Tool::One(Shape::Ellipsoid { radii_m: *radii.get_ref() })
            }
            IndenterName::Fingertip | IndenterName::Flat | IndenterName::Edge => {
                let what = "on = \"body\" takes ball, ellipsoid, rod, strap and pair";
                return Err(text.wrong(indenter.span(), what));
            }
        })
    }
}

/// The message that a path is off the skin at `t_s`.
pub(super) fn leaves_skin(t_s: f64) -> String {
    format!("`path` leaves the skin at {t_s:.3} s; keep it on the body, or the force at 0 there")
}
