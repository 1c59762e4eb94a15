//! Pictures of a touch: pressures on the taxels of a body, and on them what the fields in contact report.

use glam::DVec3;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::colour::{PALETTE, PAPER, linear};
use super::edges::Lines;
use super::labels::{INK, Labels};
use super::{Options, Picture, Prepared, stem};
use crate::backend::gpu::raster;
use crate::body::{BODY_FROM_WORLD, Body};
use crate::colours::pressure_colours;
use crate::error::Result;
use crate::field::Field;
use crate::ink::{self, FAMILY, cannot};
use crate::percept::Percept;

/// A taxel that feels nothing.
const IDLE: [u8; 3] = [0xD6, 0xD6, 0xD4];
/// A taxel whose value is missing or not used.
const UNUSED: [u8; 3] = [0xFF, 0xFF, 0xFF];
/// Length of the line of an orientation to either side, and of the longer half axis, in shares of the field's radius.
const LINE_SHARE: f64 = 0.6;
const ELLIPSE_SHARE: f64 = 0.4;
/// Time whose motion the arrow shows, s.
const ARROW_S: f64 = 0.25;
/// Points of an ellipse.
const CORNERS: usize = 48;
/// Marks are drawn in views that the touch faces by at least this cosine.
const MIN_FACING: f64 = 0.15;

/// What is touched at one time.
#[derive(Clone, Debug)]
pub struct Moment<'a> {
    /// By the body's taxels, P; `None` where it is unknown.
    pub pressures: &'a [Option<f64>],
    /// P at the upper end of the colours; without it there is no legend.
    pub max_pressure: Option<f64>,
    /// Unit of P.
    pub unit: &'a str,
    /// The percepts to mark, each with the index of its field, places in the field's anchor.
    pub percepts: &'a [(usize, Percept)],
    /// Time, s.
    pub t_s: Option<f64>,
}

/// A body and its views, ready to draw touches on.
pub struct TouchPicture<'a> {
    body: &'a Body,
    fields: &'a [Field],
    prepared: Prepared,
    ids: bool,
    edges: Option<Lines>,
}

impl<'a> TouchPicture<'a> {
    /// For touches of `body` with `fields`; with `ids`, taxels are labelled with their ids.
    ///
    /// # Errors
    /// As [`super::of_body`].
    pub fn new(body: &'a Body, fields: &'a [Field], options: &Options, ids: bool) -> Result<Self> {
        let key = vec![(None, "0.00 s".to_owned())];
        let prepared = Prepared::new(body, fields, options, &title(body), key)?;
        let edges = options.edges.then(|| prepared.edges(body));
        Ok(Self { body, fields, prepared, ids, edges })
    }

    /// A picture of `moment`.
    ///
    /// # Errors
    /// As [`super::of_body`].
    pub fn draw(&self, moment: &Moment<'_>) -> Result<Picture> {
        let Prepared { size, middle, arrangement, dots, views, .. } = &self.prepared;
        let colours = pressure_colours();
        let colour = |pressure: &Option<f64>| match pressure {
            None => UNUSED,
            Some(p) if *p <= 0.0 => IDLE,
            Some(p) => colours[(p / moment.max_pressure.unwrap_or(1.0) * 255.0).round().clamp(0.0, 255.0) as usize],
        };
        let taxels: Vec<[u8; 3]> = moment.pressures.iter().map(colour).collect();
        let usual = self.prepared.usual_radius();
        let mut drawing = self.prepared.drawing(linear(PAPER));
        drawing.slices = dots.flat_slices(&taxels, *middle, usual > 2.0);
        let mut pixels = raster::draw(&drawing)?;
        if let Some(lines) = &self.edges {
            lines.draw(*size, &mut pixels)?;
        }

        let mut labels = Labels::new(&title(self.body), size[0]);
        labels.key(vec![(None, moment.t_s.map_or(String::new(), |t_s| format!("{t_s:.2} s")))], *size);
        for (view, placed) in views.iter().zip(&arrangement.views) {
            let [left, top, width, _] = placed.part;
            labels.caption(view.word(), [left + width / 2, top.saturating_sub(labels.above_view() / 2)]);
        }
        labels.bar(arrangement.scale);
        if let Some(max) = moment.max_pressure {
            labels.pressures(max, moment.unit);
        }
        labels.draw(&mut pixels, *size)?;
        self.mark(moment, &mut pixels)?;
        Ok(Picture { size: *size, pixels })
    }

    /// Draws the marks of the percepts, and ids.
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
            if self.ids {
                let style = (FAMILY, 13).into_font().color(&INK).pos(Pos::new(HPos::Center, VPos::Center));
                for ((place, normal), taxel) in dots.places.iter().zip(&dots.normals).zip(&self.body.taxels) {
                    if normal.dot(towards) > MIN_FACING {
                        area.draw_text(&taxel.id.to_string(), &style, pixel(*place)).map_err(cannot)?;
                    }
                }
            }
            for (number, (field, percept)) in moment.percepts.iter().enumerate() {
                let [r, g, b] = PALETTE[number % PALETTE.len()];
                let Some(mark) = Mark::new(self.body, &self.fields[*field], percept) else { continue };
                if mark.normal.dot(towards) < MIN_FACING {
                    continue;
                }
                for (line, width) in mark.lines() {
                    let line: Vec<(i32, i32)> = line.into_iter().map(pixel).collect();
                    for (colour, width) in [(WHITE, width + 3), (RGBColor(r, g, b), width)] {
                        area.draw(&PathElement::new(line.clone(), colour.stroke_width(width))).map_err(cannot)?;
                    }
                }
                let at = pixel(mark.place);
                for (radius, colour) in [(7, WHITE), (5, RGBColor(r, g, b)), (2, WHITE)] {
                    area.draw(&Circle::new(at, radius, colour.filled())).map_err(cannot)?;
                }
            }
        }
        area.present().map_err(cannot)
    }
}

fn title(body: &Body) -> String {
    stem(&body.name).to_owned()
}

/// What marks a percept, in the body.
struct Mark {
    place: DVec3,
    normal: DVec3,
    /// Directions of +u and +v; none without a chart.
    axes: Option<[DVec3; 2]>,
    orientation: Option<f64>,
    /// Direction and anisotropy of the principal axis.
    axis: Option<(f64, f64)>,
    /// Motion in [`ARROW_S`], m.
    motion: Option<DVec3>,
    radius_m: f64,
}

impl Mark {
    fn new(body: &Body, field: &Field, percept: &Percept) -> Option<Self> {
        let body_from_anchor = field.anchor.map_or(BODY_FROM_WORLD, |link| body.links[link].body_from_link);
        let turned = |direction: DVec3| body_from_anchor.transform_vector3(direction);
        let axes = field.chart.as_ref().ok().map(|chart| [chart.u_in_anchor, chart.v_in_anchor].map(turned));
        let motion = axes
            .zip(percept.direction)
            .zip(percept.speed)
            .map(|(([u, v], direction), speed)| speed * ARROW_S * (u * direction.cos() + v * direction.sin()));
        Some(Self {
            place: body_from_anchor.transform_point3(DVec3::from_array(percept.position?)),
            normal: turned(DVec3::from_array(percept.normal?)),
            axes,
            orientation: percept.orientation,
            axis: percept.principal_axis.zip(percept.anisotropy),
            motion,
            radius_m: field.radius_m(),
        })
    }

    /// Lines with their widths in pixels: the orientation, the ellipse and the arrow.
    fn lines(&self) -> Vec<(Vec<DVec3>, u32)> {
        let Some([u, v]) = self.axes else { return Vec::new() };
        let at = |angle: f64| u * angle.cos() + v * angle.sin();
        let mut lines = Vec::new();
        if let Some(angle) = self.orientation {
            let way = LINE_SHARE * self.radius_m * at(angle);
            lines.push((vec![self.place - way, self.place + way], 3));
        }
        if let Some((angle, anisotropy)) = self.axis {
            // λ₁/λ₂ = (1 + a)/(1 − a), and half axes go as the roots.
            let long = ELLIPSE_SHARE * self.radius_m;
            let short = long * ((1.0 - anisotropy) / (1.0 + anisotropy)).max(0.0).sqrt();
            let corner = |i: usize| {
                let turn = std::f64::consts::TAU * i as f64 / CORNERS as f64;
                let across = at(angle + std::f64::consts::FRAC_PI_2);
                self.place + long * turn.cos() * at(angle) + short * turn.sin() * across
            };
            lines.push(((0..=CORNERS).map(corner).collect(), 1));
        }
        if let Some(motion) = self.motion.filter(|motion| motion.length() > 0.1 * self.radius_m) {
            let tip = self.place + motion.clamp_length_max(1.5 * self.radius_m);
            let back = -0.18 * self.radius_m * motion.normalize();
            let side = 0.7 * self.normal.cross(back);
            lines.push((vec![self.place, tip], 3));
            lines.push((vec![tip + back + side, tip, tip + back - side], 3));
        }
        lines
    }
}
