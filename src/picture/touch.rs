//! Pictures of touches: what the taxels of a body read, and a mark for each touch of the whole body.

use glam::DVec3;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::colour::{PALETTE, PAPER, RIM, linear};
use super::edges::{Lines, seen};
use super::labels::{INK, Labels, Legend, PlacedId, half_of_id, short, write_ids};
use super::shape::{Disc, DiscKind, Dots};
use super::{Options, Picture, Prepared, arrows, stem};
use crate::backend::gpu::raster;
use crate::body::{Body, Modality};
use crate::colours::{COLOURS, distance_colours, pressure_colours, temperature_colours};
use crate::error::Result;
use crate::field::Field;
use crate::ink::{self, FAMILY, cannot};
use crate::percept::Touch;
use crate::signal::Receptor;

/// A taxel that feels nothing.
const IDLE: [u8; 3] = [0xD6, 0xD6, 0xD4];
/// A taxel whose value is missing or not used.
const UNUSED: [u8; 3] = [0xFF, 0xFF, 0xFF];
/// Half axes of an ellipse, in standard deviations: about the edge of what presses evenly.
const ELLIPSE_SIGMAS: f64 = 2.0;
/// Time whose motion the arrow shows, s.
const ARROW_S: f64 = 0.25;
/// Points of an ellipse.
const CORNERS: usize = 48;
/// Width of a trail, pixels, and how opaque its oldest part is.
const TRAIL_WIDTH: u32 = 3;
const OLDEST_OPACITY: f64 = 0.15;
/// Radius of a mark, in radii of a usual taxel.
const MARK_RADII: f64 = 0.9;
/// Marks are drawn in views that the touch faces by at least this cosine.
const MIN_FACING: f64 = 0.15;

/// A touch of the whole body on a picture.
#[derive(Clone, Debug)]
pub struct MarkedTouch {
    /// The touch, its place in the frame of its link.
    pub touch: Touch,
    /// Its taxels, by their index in the body.
    pub taxels: Vec<usize>,
    /// Where it was in the last second, the oldest first: a link, and a place in its frame.
    pub trail: Vec<(u32, DVec3)>,
}

/// What is touched at one time.
#[derive(Clone, Debug)]
pub struct Moment<'a> {
    /// What is shown of taxels.
    pub letter: Receptor,
    /// By the body's taxels what they read, P, °C or a distance; `None` where it is unknown, or not what they read. A distance is
    /// infinite where nothing is near.
    pub values: &'a [Option<f64>],
    /// The ends of the colours; without them there is no legend.
    pub ends: Option<[f64; 2]>,
    /// The unit of all that.
    pub unit: &'a str,
    /// Tangential forces: taxels by their index in the body, and the force in the frame of their link.
    pub shear: &'a [(usize, DVec3)],
    /// The touches to mark.
    pub touches: &'a [MarkedTouch],
    /// Time, s.
    pub t_s: Option<f64>,
}

impl<'a> Moment<'a> {
    /// Pressures without touches, colours and time.
    #[must_use]
    pub fn of_pressures(values: &'a [Option<f64>]) -> Self {
        Self { letter: Receptor::Sustained, values, ends: None, unit: "", shear: &[], touches: &[], t_s: None }
    }
}

/// A body and its views, ready to draw touches on.
pub struct TouchPicture<'a> {
    body: &'a Body,
    prepared: Prepared,
    /// By view, the taxels that are labelled with their ids.
    labelled: Vec<Vec<bool>>,
    edges: Option<Lines>,
}

somatic_skin::debug_by_name!(TouchPicture<'_>);

impl<'a> TouchPicture<'a> {
    /// For touches of `body` with `fields`; with `ids`, taxels are labelled with their ids in the views that see them.
    ///
    /// # Errors
    /// As [`super::of_body`].
    pub fn new(body: &'a Body, fields: &'a [Field], options: &Options, ids: bool) -> Result<Self> {
        let key = vec![(None, "0.00 s".to_owned())];
        let narrow = Dots::from_body(body);
        // No disc may cover the id of another.
        let dots = if ids { narrow } else { narrow.by_kind(body.taxels.iter()) };
        let prepared = Prepared::new(body, dots, (fields, options), &title(body), key)?;
        let edges = options.edges.then(|| prepared.edges(body));
        let labelled = if ids { seen(body, &prepared.dots, &prepared.views) } else { Vec::new() };
        Ok(Self { body, prepared, labelled, edges })
    }

    /// A picture of `moment`.
    ///
    /// # Errors
    /// As [`super::of_body`].
    pub fn draw(&self, moment: &Moment<'_>) -> Result<Picture> {
        let Prepared { size, middle, arrangement, dots, views, .. } = &self.prepared;
        let usual = self.prepared.usual_radius();
        let mut drawing = self.prepared.drawing(linear(PAPER));
        let discs = moment.discs(self.body.taxels.iter().map(|taxel| taxel.modality), !self.labelled.is_empty());
        drawing.slices = dots.flat_slices(&discs, *middle, usual > 2.0);
        let mut pixels = raster::draw(&drawing)?;
        let of_taxel = |taxel: usize| [discs[taxel].colour, discs[taxel].touched.unwrap_or(RIM)];
        self.prepared.outlines.draw(of_taxel, *size, &mut pixels)?;
        if let Some(lines) = &self.edges {
            lines.draw(*size, &mut pixels)?;
        }

        let mut labels = Labels::new(&moment.titled(&title(self.body)), size[0]);
        labels.key(vec![(None, moment.t_s.map_or(String::new(), |t_s| format!("{t_s:.2} s")))], *size);
        for (view, placed) in views.iter().zip(&arrangement.views) {
            let [left, top, width, _] = placed.part;
            labels.caption(view.word(), [left + width / 2, top.saturating_sub(labels.above_view() / 2)]);
        }
        labels.bar(arrangement.scale);
        moment.legend(&discs).into_iter().for_each(|legend| labels.colours(legend));
        moment.arrow_key(usual).into_iter().for_each(|key| labels.arrow(key));
        labels.draw(&mut pixels, *size)?;
        self.write_ids(&discs, &mut pixels)?;
        self.draw_shear(moment, &mut pixels)?;
        self.mark(moment, &mut pixels)?;
        Ok(Picture { size: *size, pixels })
    }

    /// Writes the ids of the taxels that a view sees, as far as they fit into its part of the picture.
    fn write_ids(&self, discs: &[Disc], pixels: &mut [u8]) -> Result<()> {
        let Prepared { size, middle, arrangement, dots, .. } = &self.prepared;
        let ids: Vec<String> = self.body.taxels.iter().map(|taxel| taxel.id.to_string()).collect();
        let mut placed = Vec::new();
        for (index, labelled) in self.labelled.iter().enumerate() {
            for taxel in (0..ids.len()).filter(|&taxel| labelled[taxel]) {
                let at = arrangement.pixel(index, dots.places[taxel] - *middle);
                if arrangement.views[index].holds_all(at, half_of_id(&ids[taxel])) {
                    let Disc { colour, kind, .. } = discs[taxel];
                    placed.push(PlacedId { id: &ids[taxel], at, on: colour, is_behind: kind != DiscKind::Shown });
                }
            }
        }
        write_ids(pixels, *size, placed)
    }

    /// Draws an arrow for each tangential force, on the taxels that look towards the eye.
    fn draw_shear(&self, moment: &Moment<'_>, pixels: &mut [u8]) -> Result<()> {
        let Some(most) = moment.shear_ends() else { return Ok(()) };
        let Prepared { size, middle, arrangement, dots, views, .. } = &self.prepared;
        let mut seen = Vec::new();
        for (index, view) in views.iter().enumerate() {
            let towards = view.axes()[2];
            let pixel = |place: DVec3| arrangement.pixel(index, place - *middle);
            for &(taxel, force) in moment.shear {
                let link = self.body.taxels[taxel].link;
                let along = self.body.links[link].body_from_link.transform_vector3(force);
                let from = dots.places[taxel];
                let ends = [from, from + along * arrows::length(1.0, dots.mean_radius(), most)].map(pixel);
                let facing = dots.normals[taxel].dot(towards);
                if facing >= MIN_FACING && arrangement.views[index].holds(ends[0].map(|x| x.round() as i32).into()) {
                    seen.push(ends);
                }
            }
        }
        arrows::draw(pixels, *size, seen.into_iter())
    }

    /// Draws the marks of the touches.
    fn mark(&self, moment: &Moment<'_>, pixels: &mut [u8]) -> Result<()> {
        ink::font()?;
        let Prepared { size: [width, height], middle, arrangement, dots, views, .. } = &self.prepared;
        let area = BitMapBackend::with_buffer(pixels, (*width, *height)).into_drawing_area();
        for (index, view) in views.iter().enumerate() {
            let towards = view.axes()[2];
            let pixel = |place: DVec3| {
                let [x, y] = arrangement.pixel(index, place - *middle);
                (x.round() as i32, y.round() as i32)
            };
            let is_inside = |at: (i32, i32)| arrangement.views[index].holds(at);
            for marked in moment.touches {
                let [r, g, b] = own_colour(&marked.touch);
                let colour = RGBColor(r, g, b);
                let mark = Mark::new(self.body, marked, dots.mean_radius());
                // A mark is where its touch is: not in a view that shows another part of the body.
                if mark.normal.dot(towards) < MIN_FACING || !is_inside(pixel(mark.place)) {
                    continue;
                }
                for (line, opacity) in mark.trail_lines() {
                    let line: Vec<(i32, i32)> = line.into_iter().map(pixel).collect();
                    let style = colour.mix(opacity).stroke_width(TRAIL_WIDTH);
                    area.draw(&PathElement::new(line, style)).map_err(cannot)?;
                }
                for (line, width) in mark.lines() {
                    let line: Vec<(i32, i32)> = line.into_iter().map(pixel).collect();
                    for (colour, width) in [(WHITE, width + 3), (colour, width)] {
                        area.draw(&PathElement::new(line.clone(), colour.stroke_width(width))).map_err(cannot)?;
                    }
                }
                let (x, y) = pixel(mark.place);
                // As large as a taxel, so that a mark does not cover the touch that it marks.
                let size = (self.prepared.usual_radius() * MARK_RADII).clamp(2.5, 7.0);
                for (share, colour) in [(1.0, WHITE), (0.7, colour), (0.3, WHITE)] {
                    let radius = (share * size).round() as i32;
                    area.draw(&Circle::new((x, y), radius, colour.filled())).map_err(cannot)?;
                }
                let style = (FAMILY, 15).into_font().color(&INK).pos(Pos::new(HPos::Left, VPos::Bottom));
                area.draw_text(&marked.touch.id.to_string(), &style, (x + 8, y - 6)).map_err(cannot)?;
            }
        }
        area.present().map_err(cannot)
    }
}

fn title(body: &Body) -> String {
    stem(&body.name).to_owned()
}

impl Moment<'_> {
    /// The colours of what is shown.
    fn map(&self) -> [[u8; 3]; COLOURS] {
        match self.letter {
            Receptor::Temperature => temperature_colours(),
            Receptor::Proximity => distance_colours(),
            _ => pressure_colours(),
        }
    }

    /// By the body's taxels, which measure `modalities`, what is drawn of each. One that measures something else than the letter is a
    /// small grey dot behind, unless its id `is_labelled`.
    pub(super) fn discs(&self, modalities: impl Iterator<Item = Modality>, is_labelled: bool) -> Vec<Disc> {
        let colours = self.map();
        let [least, most] = self.ends.unwrap_or([0.0, 1.0]);
        let is_temperature = self.letter == Receptor::Temperature;
        let colour = |value: Option<f64>| match value {
            // White is in the middle of temperatures.
            None if is_temperature => IDLE,
            None => UNUSED,
            Some(value) if (value <= 0.0 && !is_temperature) || value.is_infinite() => IDLE,
            Some(value) => colours[((value - least) / (most - least) * 255.0).round().clamp(0.0, 255.0) as usize],
        };
        let disc = |(value, modality): (&Option<f64>, Modality)| {
            if self.letter.reads(modality) {
                return Disc { colour: colour(*value), touched: None, kind: DiscKind::Shown };
            }
            let kind = if is_labelled { DiscKind::Behind } else { DiscKind::Small };
            Disc { colour: IDLE, touched: None, kind }
        };
        let mut discs: Vec<Disc> = self.values.iter().zip(modalities).map(disc).collect();
        for marked in self.touches {
            marked.taxels.iter().for_each(|&taxel| discs[taxel].touched = Some(own_colour(&marked.touch)));
        }
        discs
    }

    /// A picture's title: `name`, and what is shown of it if that is not pressure.
    pub(super) fn titled(&self, name: &str) -> String {
        if self.letter.is_of_pressure() { name.to_owned() } else { format!("{name} · {}", self.letter) }
    }

    /// The legend of the colours, if there is one, and of what else `discs` look like.
    pub(super) fn legend(&self, discs: &[Disc]) -> Option<Legend> {
        let other = discs.iter().map(|disc| disc.kind).find(|kind| *kind != DiscKind::Shown);
        let note = match (self.letter, other.unwrap_or(DiscKind::Shown)) {
            (Receptor::Proximity, DiscKind::Shown) => "grey: nothing in range",
            (_, DiscKind::Shown) => "",
            (Receptor::Proximity, DiscKind::Small) => "grey: nothing in range; small: taxels of another kind",
            (_, DiscKind::Small) => "small: taxels of another kind",
            (Receptor::Proximity, DiscKind::Behind) => "grey: nothing in range, or of another kind",
            (Receptor::Temperature, DiscKind::Behind) => "grey: taxels of another kind",
            (_, DiscKind::Behind) => "grey: nothing felt, or of another kind",
        };
        Some(Legend { colours: self.map(), ends: self.ends?, unit: self.unit.to_owned(), note: note.to_owned() })
    }

    /// If there are arrows of forces, one that stands for a round force: its length, pixels, on taxels of `radius` pixels, and the force.
    pub(super) fn arrow_key(&self, radius: f64) -> Option<(f64, String)> {
        let most = self.shear_ends()?;
        let force = arrows::round_force(most);
        Some((arrows::length(force, radius, most), format!("{} {}", short(force), self.unit)))
    }

    /// The force that the longest arrow stands for, if there are arrows.
    pub(super) fn shear_ends(&self) -> Option<f64> {
        let is_force = matches!(self.letter, Receptor::Sustained | Receptor::Shear);
        self.ends.map(|[_, most]| most).filter(|_| is_force && !self.shear.is_empty())
    }
}

/// A touch keeps its colour as long as it lasts.
pub(super) fn own_colour(touch: &Touch) -> [u8; 3] {
    PALETTE[(touch.id % PALETTE.len() as u64) as usize]
}

/// What marks a touch, in the body at rest.
struct Mark {
    place: DVec3,
    normal: DVec3,
    /// Half axes of the ellipse: along and across the principal axis.
    half_axes: Option<[DVec3; 2]>,
    /// Motion in [`ARROW_S`], m.
    motion: Option<DVec3>,
    /// The oldest first, up to the place.
    trail: Vec<DVec3>,
    /// Radius of a usual taxel, m.
    taxel_m: f64,
}

impl Mark {
    fn new(body: &Body, MarkedTouch { touch, trail, .. }: &MarkedTouch, taxel_m: f64) -> Self {
        let body_from = |link: u32| body.links[link as usize].body_from_link;
        let body_from_link = body_from(touch.link);
        let normal = body_from_link.transform_vector3(touch.normal);
        let half_axes = touch.principal_axis.zip(touch.spread_m).map(|(axis, [along, across])| {
            let axis = body_from_link.transform_vector3(axis);
            [ELLIPSE_SIGMAS * along * axis, ELLIPSE_SIGMAS * across * normal.cross(axis).normalize_or_zero()]
        });
        let place = body_from_link.transform_point3(touch.best_place());
        let were = trail.iter().map(|&(link, place)| body_from(link).transform_point3(place));
        Self {
            place,
            normal,
            half_axes,
            motion: touch.velocity.map(|velocity| ARROW_S * body_from_link.transform_vector3(velocity)),
            trail: were.chain([place]).collect(),
            taxel_m,
        }
    }

    /// The parts of the trail, each with how opaque it is.
    fn trail_lines(&self) -> Vec<([DVec3; 2], f64)> {
        let parts = self.trail.len().saturating_sub(1);
        let opacity = |part: usize| OLDEST_OPACITY + (1.0 - OLDEST_OPACITY) * (part + 1) as f64 / parts as f64;
        self.trail.windows(2).enumerate().map(|(part, ends)| ([ends[0], ends[1]], opacity(part))).collect()
    }

    /// Lines with their widths in pixels: the axis with its ellipse, and the arrow.
    fn lines(&self) -> Vec<(Vec<DVec3>, u32)> {
        let mut lines = Vec::new();
        if let Some([along, across]) = self.half_axes {
            let corner = |i: usize| {
                let turn = std::f64::consts::TAU * i as f64 / CORNERS as f64;
                self.place + turn.cos() * along + turn.sin() * across
            };
            lines.push((vec![self.place - along, self.place + along], 3));
            lines.push(((0..=CORNERS).map(corner).collect(), 1));
        }
        if let Some(motion) = self.motion.filter(|motion| motion.length() > 0.5 * self.taxel_m) {
            let tip = self.place + motion;
            let back = -(0.3 * motion.length()).min(self.taxel_m) * motion.normalize();
            let side = 0.7 * self.normal.cross(back);
            lines.push((vec![self.place, tip], 3));
            lines.push((vec![tip + back + side, tip, tip + back - side], 3));
        }
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mark() -> Mark {
        let place = DVec3::new(1.0, 0.0, 0.0);
        let half_axes = Some([DVec3::new(0.0, 0.02, 0.0), DVec3::new(0.0, 0.0, 0.01)]);
        let trail = (0..5).map(|i| DVec3::new(0.6 + 0.1 * f64::from(i), 0.0, 0.0)).collect();
        let motion = Some(DVec3::new(0.0, 0.0, 0.1));
        Mark { place, normal: DVec3::X, half_axes, motion, trail, taxel_m: 0.005 }
    }

    #[test]
    fn a_trail_fades_towards_its_beginning() {
        let lines = mark().trail_lines();
        assert_eq!(lines.len(), 4);
        assert!(lines.windows(2).all(|pair| pair[0].1 < pair[1].1 && pair[0].0[1] == pair[1].0[0]), "{lines:?}");
        assert_eq!((lines[3].1, lines[3].0[1]), (1.0, mark().place));
        assert!(Mark { trail: vec![DVec3::X], ..mark() }.trail_lines().is_empty());
    }

    #[test]
    fn an_ellipse_goes_through_the_ends_of_its_axis_and_an_arrow_points_where_the_touch_goes() {
        let lines = mark().lines();
        assert_eq!(lines.len(), 4);
        let (axis, ellipse) = (&lines[0].0, &lines[1].0);
        assert!((axis[1] - ellipse[0]).length() < 1e-12 && (axis[0] - ellipse[CORNERS / 2]).length() < 1e-12);
        assert!(ellipse.iter().all(|corner| (corner.x - 1.0).abs() < 1e-12), "in the tangent plane");
        assert_eq!(lines[2].0[1], DVec3::new(1.0, 0.0, 0.1));
        assert!(lines[3].0.iter().all(|end| end.z <= 0.1 && end.z > 0.09), "{:?}", lines[3]);
        // What hardly moves has no arrow, and what has no axis no ellipse.
        let still = Mark { motion: Some(DVec3::new(0.0, 0.002, 0.0)), ..mark() };
        assert_eq!(still.lines().len(), 2);
        assert!(Mark { half_axes: None, motion: None, ..mark() }.lines().is_empty());
    }

    #[test]
    fn a_legend_says_what_grey_means() {
        let values = [Some(f64::INFINITY), None];
        let moment = Moment { letter: Receptor::Proximity, ends: Some([0.0, 80.0]), ..Moment::of_pressures(&values) };
        let note = |letter: Receptor, kinds: &[Modality], are_labelled: bool| {
            let moment = Moment { letter, ..moment.clone() };
            let discs = moment.discs(kinds.iter().copied(), are_labelled);
            assert!(discs.iter().all(|disc| disc.colour == IDLE || disc.colour == UNUSED));
            moment.legend(&discs).unwrap().note
        };
        let mixed = [Modality::Proximity, Modality::Pressure];
        let distances = Receptor::Proximity;
        assert_eq!(note(distances, &[Modality::Proximity; 2], false), "grey: nothing in range");
        assert_eq!(note(distances, &mixed, false), "grey: nothing in range; small: taxels of another kind");
        assert_eq!(note(distances, &mixed, true), "grey: nothing in range, or of another kind");
        for letter in [Receptor::Sustained, Receptor::Temperature] {
            let own = if letter == Receptor::Sustained { Modality::Pressure } else { Modality::Temperature };
            assert_eq!(note(letter, &[own; 2], false), "");
            assert_eq!(note(letter, &[own, Modality::Proximity], false), "small: taxels of another kind");
        }
        let of_all = [Modality::Temperature, Modality::Pressure];
        assert_eq!(note(Receptor::Temperature, &of_all, true), "grey: taxels of another kind");
        assert_eq!(note(Receptor::Shear, &of_all, true), "grey: nothing felt, or of another kind");
    }
}
