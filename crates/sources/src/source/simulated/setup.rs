//! Checks the file's keys and builds the touches on the body's surface.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::DVec3;
use toml::Spanned;

use super::contact::{Indenter, Layer};
use super::file::{AngleKeys, ContactName, IndenterName, KernelName, LayerKeys, TouchKeys, WaypointKeys};
use super::layer::Kernel;
use super::patch::Pressure;
use super::path::{Path, PathFrame};
use super::profile::Profile;
use super::radial::Radial;
use crate::body::{Body, SurfaceIndex};
use crate::error::Result;
use crate::field::{FieldSet, Lift};
use crate::keys::Text;

/// Of a fingertip's contact, length over width: beyond it is a rod.
const MAX_ASPECT: f64 = 10.0;

/// One touch: its path and force over time.
pub(super) struct Touch {
    pub(super) name: String,
    pub(super) link: usize,
    /// The links whose taxels feel it: its own, or those of its field's taxels.
    pub(super) pressed: Vec<usize>,
    pub(super) field: Option<String>,
    pub(super) indenter: Indenter,
    /// rad
    pub(super) angle: Option<Profile>,
    pub(super) path: Path,
    pub(super) force_newton: Profile,
    /// Whether the body has taxels that see distances.
    pub(super) is_seen: bool,
    /// How far its lowest point is above the skin while it does not press, m; `None` where nothing sees that.
    pub(super) gap_m: Option<Profile>,
}

impl Touch {
    /// The force at `t_s`, if the touch presses.
    pub(super) fn force(&self, t_s: f64) -> Option<f64> {
        self.force_newton.within(t_s).filter(|&force| force > 0.0)
    }

    /// How far above the skin it is at `t_s`, m, if that can be seen: 0 while it presses.
    pub(super) fn gap(&self, t_s: f64) -> Option<f64> {
        match self.force(t_s) {
            Some(_) => self.is_seen.then_some(0.0),
            None => self.gap_m.as_ref()?.within(t_s),
        }
    }

    /// Whether it presses or is seen at `t_s`.
    pub(super) fn is_there(&self, t_s: f64) -> bool {
        self.force(t_s).is_some() || self.gap(t_s).is_some()
    }

    /// The message that the path is off the surface at `t_s`.
    pub(super) fn leaves_surface(&self, t_s: f64) -> String {
        let place = self.path.waypoint(t_s);
        let at = match self.path.frame {
            PathFrame::Chart { .. } | PathFrame::Curved { .. } => {
                format!("(u, v) = ({:.4}, {:.4}) m", place.x, place.y)
            }
            PathFrame::Link => format!("({:.4}, {:.4}, {:.4}) m", place.x, place.y, place.z),
        };
        format!("`path` leaves the surface at {t_s:.3} s, at {at}; keep it on the body, or the force at 0 there")
    }
}

/// Builds touches from keys for a body.
pub(super) struct Setup<'a> {
    pub(super) text: Text<'a>,
    pub(super) body: &'a Body,
    pub(super) fields: &'a FieldSet,
    /// By link, and whether it is of that link alone.
    pub(super) surfaces: BTreeMap<(usize, bool), Arc<SurfaceIndex>>,
    pub(super) duration_s: f64,
}

impl Setup<'_> {
    pub(super) fn layer(&self, keys: Option<&LayerKeys>) -> Result<Layer> {
        let Some(keys) = keys else { return Ok(Layer::NONE) };
        let or = |key: &str, value: &Option<Spanned<f64>>, default: f64| {
            value.as_ref().map_or(Ok(default), |value| self.text.positive(key, value))
        };
        let name = keys.kernel.as_ref().map_or(KernelName::Gaussian, |kernel| *kernel.get_ref());
        let kernel = match name {
            KernelName::Gaussian => Kernel::Gaussian,
            KernelName::Boussinesq => Kernel::Radial(Radial::Boussinesq),
            KernelName::Exponential => Kernel::Radial(Radial::Exponential),
            KernelName::Bonded => Kernel::Radial(Radial::Bonded),
        };
        if kernel != Kernel::Gaussian {
            self.text.refuse("spread", keys.spread.as_ref(), format!("with `kernel = \"{}\"`", name.word()))?;
        }
        let contact = match keys.contact.as_ref().map(|contact| (*contact.get_ref(), contact.span())) {
            Some((ContactName::Gaussian, at)) if kernel != Kernel::Gaussian => {
                let what = format!("`contact` is gaussian; with `kernel = \"{}\"` it must be hertz", name.word());
                return Err(self.text.wrong(at, what));
            }
            None if kernel == Kernel::Gaussian => Pressure::Gaussian,
            Some((ContactName::Gaussian, _)) => Pressure::Gaussian,
            None | Some((ContactName::Hertz, _)) => Pressure::Hertz,
        };
        let is_plain = kernel == Kernel::Gaussian && contact == Pressure::Gaussian;
        let thickness_m = if is_plain {
            self.text.not_negative("thickness_m", &keys.thickness_m)?
        } else {
            self.text.positive("thickness_m", &keys.thickness_m)?
        };
        Ok(Layer {
            thickness_m,
            spread: or("spread", &keys.spread, Layer::SPREAD)?,
            stiffness_pa: or("stiffness_pa", &keys.stiffness_pa, Layer::STIFFNESS_PA)?,
            kernel,
            contact,
        })
    }

    pub(super) fn touch(&mut self, index: usize, keys: &TouchKeys) -> Result<Touch> {
        let indenter = self.indenter(keys)?;
        let (in_chart, waypoints) = self.waypoints(keys)?;
        let (link, field, frame) = if in_chart { self.on_field(keys)? } else { self.on_link(keys)? };
        let pressed = self.pressed(link, field.as_deref());
        let body = self.body;
        let in_link = || Arc::new(if in_chart { body.surface_in_link(link) } else { surface_of(body, link) });
        let surface = Arc::clone(self.surfaces.entry((link, in_chart)).or_insert_with(in_link));
        if surface.is_empty() {
            return Err(self.text.wrong(keys.on.span(), "the body has no surface that could be touched"));
        }
        let times_s = self.times(keys, &waypoints)?;
        let touch = Touch {
            name: keys.name.clone().unwrap_or_else(|| format!("touch {}", index + 1)),
            link,
            pressed,
            field,
            indenter,
            angle: self.angle(keys, indenter.is_long())?,
            path: Path { frame, surface, waypoints, times_s },
            force_newton: self.force(keys)?,
            is_seen: self.sees(),
            gap_m: self.gap(keys)?,
        };
        let gaps = touch.gap_m.iter().flat_map(Profile::times);
        let times = touch.path.times_to_check().chain(touch.force_newton.times()).chain(gaps);
        let mut pressed = times.filter(|&t_s| t_s <= self.duration_s && touch.is_there(t_s));
        let off_surface = pressed.find(|&t_s| touch.path.place(t_s).is_none());
        drop(pressed);
        match off_surface {
            Some(t_s) => Err(self.text.wrong(keys.path.span(), touch.leaves_surface(t_s))),
            None => Ok(touch),
        }
    }

    fn indenter(&self, keys: &TouchKeys) -> Result<Indenter> {
        let (text, indenter) = (self.text, &keys.indenter);
        let size = |key: &str, value: &Option<Spanned<f64>>, default: Option<f64>| match (value, default) {
            (Some(value), _) => text.positive(key, value),
            (None, Some(default)) => Ok(default),
            (None, None) => Err(text.wrong(indenter.span(), format!("this indenter needs its `{key}`"))),
        };
        let refuse = |key: &str, value: &Option<Spanned<f64>>| text.refuse(key, value.as_ref(), "for this indenter");
        refuse("width_m", &keys.width_m)?;
        refuse("apart_m", &keys.apart_m)?;
        if *indenter.get_ref() != IndenterName::Fingertip {
            refuse("aspect", &keys.aspect)?;
        }
        text.refuse("radii_m", keys.radii_m.as_ref(), "for this indenter")?;
        let radius = |default| size("radius_m", &keys.radius_m, default);
        let length = || size("length_m", &keys.length_m, None);
        match indenter.get_ref() {
            IndenterName::Rod => Ok(Indenter::Rod { radius_m: radius(None)?, length_m: length()? }),
            IndenterName::Edge => {
                refuse("radius_m", &keys.radius_m)?;
                Ok(Indenter::Edge { length_m: length()? })
            }
            IndenterName::Ellipsoid | IndenterName::Strap | IndenterName::Pair => {
                let what = "this indenter presses whole bodies; give `on = \"body\"`, and places of the body as `path`";
                Err(text.wrong(indenter.span(), what))
            }
            round => {
                refuse("length_m", &keys.length_m)?;
                Ok(match round {
                    IndenterName::Ball => Indenter::Ball { radius_m: radius(None)? },
                    IndenterName::Flat => Indenter::Flat { radius_m: radius(None)? },
                    _ => Indenter::Fingertip {
                        radius_m: radius(Some(Indenter::FINGERTIP_RADIUS_M))?,
                        aspect: self.aspect(keys)?,
                    },
                })
            }
        }
    }

    /// How many times as long as wide the contact of a fingertip is.
    fn aspect(&self, keys: &TouchKeys) -> Result<f64> {
        let Some(aspect) = &keys.aspect else { return Ok(1.0) };
        match *aspect.get_ref() {
            bad if !(1.0..=MAX_ASPECT).contains(&bad) => Err(self
                .text
                .wrong(aspect.span(), format!("`aspect` is {bad}; give length over width, from 1 to {MAX_ASPECT}"))),
            aspect => Ok(aspect),
        }
    }

    /// Whether the waypoints are (u, v) rather than (x, y, z), and the waypoints.
    fn waypoints(&self, keys: &TouchKeys) -> Result<(bool, Vec<DVec3>)> {
        let path = keys.path.get_ref();
        let wanted = match path.first().map(Spanned::get_ref) {
            Some(WaypointKeys::Numbers(numbers)) => numbers.len(),
            _ => 0,
        };
        if path.is_empty() {
            return Err(self.text.wrong(keys.path.span(), "`path` is empty; give at least one place"));
        }
        let points = path.iter().map(|waypoint| {
            let wrong = |what: String| Err(self.text.wrong(waypoint.span(), what));
            let numbers = match waypoint.get_ref() {
                WaypointKeys::Numbers(numbers) if numbers.len() == wanted && (2..=3).contains(&wanted) => numbers,
                WaypointKeys::Numbers(_) => {
                    return wrong("`path` is all [u, v] on a field, or all [x, y, z] on a link".to_owned());
                }
                _ => return wrong("`path` has a place of the whole body, which needs `on = \"body\"`".to_owned()),
            };
            if let Some(bad) = numbers.iter().find(|x| x.is_nan() || x.abs() > 1e6) {
                return wrong(format!("`path` has the coordinate {bad}; give metres"));
            }
            Ok(DVec3::new(numbers[0], numbers[1], numbers.get(2).copied().unwrap_or(0.0)))
        });
        Ok((wanted == 2, points.collect::<Result<_>>()?))
    }

    fn on_field(&self, keys: &TouchKeys) -> Result<(usize, Option<String>, PathFrame)> {
        let on = keys.on.get_ref();
        let Some(field) = self.fields.fields.iter().find(|field| field.name == *on) else {
            if self.body.link_index(on).is_some() {
                let what = format!("`{on}` is a link, not a field; give its `path` as [x, y, z]");
                return Err(self.text.wrong(keys.on.span(), what));
            }
            return Err(self.text.unknown(&keys.on, "field", self.names()));
        };
        match (&field.chart, field.anchor) {
            (Ok(chart), Some(link)) if chart.kind.is_stored() => {
                let lift = Lift::new(self.body, field).expect("it has a chart");
                let (chart, origin_in_link) = (chart.clone(), field.origin_in_anchor);
                Ok((link, Some(on.clone()), PathFrame::Curved { chart, origin_in_link, lift: Box::new(lift) }))
            }
            (Ok(chart), Some(link)) => {
                let deepest_m = field.members.iter().map(|member| member.place.z.abs()).fold(0.0, f64::max);
                let frame = PathFrame::of_field(chart.clone(), field.origin_in_anchor, deepest_m);
                Ok((link, Some(on.clone()), frame))
            }
            (chart, _) => {
                let why = chart.as_ref().err().map(ToString::to_string).unwrap_or_default();
                let what = format!("field `{on}` has no chart for [u, v]: {why}; name a field below it, or a link");
                Err(self.text.wrong(keys.on.span(), what))
            }
        }
    }

    fn on_link(&self, keys: &TouchKeys) -> Result<(usize, Option<String>, PathFrame)> {
        let on = keys.on.get_ref();
        match self.body.link_index(on) {
            Some(link) => Ok((link, None, PathFrame::Link)),
            None if on == "body" => {
                let what = "on = \"body\" takes a `path` of { taxel = ID } or { link = \"NAME\", at = [x, y, z] }";
                Err(self.text.wrong(keys.path.span(), what))
            }
            None if self.fields.fields.iter().any(|field| field.name == *on) => {
                let what = format!("`{on}` is a field, not a link; give its `path` as [u, v]");
                Err(self.text.wrong(keys.on.span(), what))
            }
            None => Err(self.text.unknown(&keys.on, "link", self.names())),
        }
    }

    /// The links that a touch on `link` presses, ascending: it alone, or those of the taxels of `field`.
    fn pressed(&self, link: usize, field: Option<&str>) -> Vec<usize> {
        let field = field.and_then(|name| self.fields.fields.iter().find(|field| field.name == name));
        let Some(field) = field else { return vec![link] };
        let links: BTreeSet<usize> = field.members.iter().map(|member| self.body.taxels[member.taxel].link).collect();
        links.into_iter().collect()
    }

    /// The names of fields and links that can be touched.
    fn names(&self) -> impl Iterator<Item = &str> {
        let fields = self.fields.fields.iter().map(|field| field.name.as_str());
        fields.chain(self.body.links.iter().map(|link| link.name.as_str()))
    }

    /// The times of `waypoints`.
    pub(super) fn times(&self, keys: &TouchKeys, waypoints: &[DVec3]) -> Result<Vec<f64>> {
        let text = self.text;
        if let Some(times) = &keys.times_s {
            text.refuse("start_s", keys.start_s.as_ref(), "with `times_s`")?;
            text.refuse("speed_m_s", keys.speed_m_s.as_ref(), "with `times_s`")?;
            text.check_times("times_s", times.span(), times.get_ref().iter().copied())?;
            let (found, wanted) = (times.get_ref().len(), waypoints.len());
            if found != wanted {
                let what = format!("`times_s` has {found} times for {wanted} places in `path`; give each one");
                return Err(text.wrong(times.span(), what));
            }
            return Ok(times.get_ref().clone());
        }
        let mut t_s = keys.start_s.as_ref().map_or(Ok(0.0), |start| text.not_negative("start_s", start))?;
        let mut times = vec![t_s];
        if waypoints.len() > 1 {
            let Some(speed) = &keys.speed_m_s else {
                return Err(text.wrong(keys.path.span(), "`path` has several places; give `times_s` or `speed_m_s`"));
            };
            let speed = text.positive("speed_m_s", speed)?;
            for (pair, place) in waypoints.windows(2).zip(&keys.path.get_ref()[1..]) {
                let later = t_s + pair[0].distance(pair[1]) / speed;
                if later <= t_s {
                    let what = "`path` has the same place twice in a row; to rest there, give `times_s`";
                    return Err(text.wrong(place.span(), what));
                }
                t_s = later;
                times.push(t_s);
            }
        } else {
            text.refuse("speed_m_s", keys.speed_m_s.as_ref(), "where `path` is one place")?;
        }
        Ok(times)
    }

    pub(super) fn angle(&self, keys: &TouchKeys, is_long: bool) -> Result<Option<Profile>> {
        let text = self.text;
        if !is_long {
            text.refuse("angle_deg", keys.angle_deg.as_ref(), "for a round indenter")?;
            return Ok(None);
        }
        let Some(angle) = &keys.angle_deg else { return Ok(Some(Profile::constant(0.0))) };
        let points = match angle.get_ref() {
            AngleKeys::Fixed(degrees) => vec![[0.0, *degrees]],
            AngleKeys::Turning(points) => points.clone(),
        };
        text.check_times("angle_deg", angle.span(), points.iter().map(|point| point[0]))?;
        if let Some([_, bad]) = points.iter().find(|point| point[1].is_nan() || point[1].abs() > 1e6) {
            return Err(text.wrong(angle.span(), format!("`angle_deg` is {bad}; give degrees")));
        }
        Ok(Some(Profile::new(points.into_iter().map(|[t_s, degrees]| (t_s, degrees.to_radians())).collect())))
    }

    pub(super) fn force(&self, keys: &TouchKeys) -> Result<Profile> {
        let text = self.text;
        let given = [keys.force_newton.is_some(), keys.tap.is_some(), keys.press.is_some(), keys.hold.is_some()];
        if given.into_iter().filter(|&is| is).count() != 1 {
            let what = "a touch needs one of `force_newton`, `tap`, `press` and `hold`";
            return Err(text.wrong(keys.indenter.span(), what));
        }
        if let Some(list) = &keys.force_newton {
            let points: Vec<(f64, f64)> = list.get_ref().iter().map(|&[t_s, newton]| (t_s, newton)).collect();
            text.check_times("force_newton", list.span(), points.iter().map(|point| point.0))?;
            if let Some((t_s, bad)) = points.iter().find(|point| !(0.0..=1e9).contains(&point.1)) {
                let what = format!("`force_newton` is {bad} at {t_s} s; it must be 0 or more, and no more than 1e9");
                return Err(text.wrong(list.span(), what));
            }
            return Ok(Profile::new(points));
        }
        if let Some(tap) = keys.tap.as_ref().map(Spanned::get_ref) {
            let lasts_s = text.positive("lasts_s", &tap.lasts_s)?;
            let starts = tap.at_s.get_ref();
            text.check_times("at_s", tap.at_s.span(), starts.iter().copied())?;
            if starts.windows(2).any(|pair| pair[1] - pair[0] < lasts_s) {
                return Err(text.wrong(tap.at_s.span(), "`at_s` has taps that overlap; give them a touch each"));
            }
            return Ok(Profile::bells(starts, text.not_negative("newton", &tap.newton)?, lasts_s));
        }
        if let Some(press) = keys.press.as_ref().map(Spanned::get_ref) {
            let (from, to) = (text.not_negative("from_s", &press.from_s)?, text.not_negative("to_s", &press.to_s)?);
            let ramp = text.positive("ramp_s", &press.ramp_s)?;
            if to - from < 2.0 * ramp {
                let what = "`to_s` comes before the force has risen and fallen; it is at least `from_s` + 2 · `ramp_s`";
                return Err(text.wrong(press.to_s.span(), what));
            }
            let newton = text.not_negative("newton", &press.newton)?;
            let mut points = vec![(from, 0.0), (from + ramp, newton), (to - ramp, newton), (to, 0.0)];
            points.dedup_by_key(|point| point.0);
            return Ok(Profile::new(points));
        }
        let newton = keys.hold.as_ref().map_or(Ok(0.0), |hold| text.not_negative("newton", &hold.get_ref().newton))?;
        Ok(Profile::new(vec![(0.0, newton), (f64::MAX, newton)]))
    }
}

/// The surface that moves with `link`, in its frame; that of the whole body if none does.
fn surface_of(body: &Body, link: usize) -> SurfaceIndex {
    let own = body.surfaces.iter().filter(|surface| surface.is_carried_by(link));
    let own = own.filter_map(|surface| Some((surface, surface.link_from_mesh(body, link)?)));
    let own = SurfaceIndex::of_triangles(own.flat_map(|(surface, way)| surface.corners_through(way)));
    if own.is_empty() { body.surface_in_link(link) } else { own }
}
