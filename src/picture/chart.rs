//! Pictures of the chart of a field: its taxels laid flat, in the colours of fields or of pressures.

use glam::DVec3;

use super::colour::{PAPER, linear};
use super::labels::{self, Labels, Legend, PlacedId, half_of_id};
use super::shape::Dots;
use super::touch::{Moment, own_colour};
use super::view::{Arrangement, View};
use super::{FieldColours, Options, Picture, arranged, checked, counted, fan};
use crate::backend::gpu::raster::{self, Drawing, Slice};
use crate::body::Body;
use crate::error::{Error, Result};
use crate::field::Field;

/// Margin around the discs of a chart, in radii: about the distance to a neighbour.
const MARGIN_RADII: f64 = 2.5;
/// What the origin's axes take to each side, pixels.
const AXIS: f64 = 5.0;

/// A picture of the chart of field `index` of `fields`: members at their (u, v), +u to the right.
///
/// Colours are those of its children, unless `options` has others.
///
/// # Errors
/// As [`super::of_body`]; or the field has no chart.
pub fn of_chart(body: &Body, fields: &[Field], index: usize, options: &Options) -> Result<Picture> {
    ChartPicture::new(body, fields, index, options, false)?.of_fields(fields)
}

/// The chart of a field, ready to draw fields or pressures on.
pub struct ChartPicture<'a> {
    options: &'a Options,
    /// The field.
    name: String,
    /// What else is known of its chart.
    about: String,
    /// By place in the chart, the taxel's index in the body, ascending.
    held: Vec<usize>,
    dots: Dots,
    /// What is in sight, m.
    around: Vec<DVec3>,
    /// By place in the chart, what is written there.
    ids: Vec<String>,
}

impl<'a> ChartPicture<'a> {
    /// Of field `index` of `fields`; with `ids`, taxels are labelled with their ids.
    ///
    /// # Errors
    /// As [`of_chart`].
    pub fn new(body: &Body, fields: &[Field], index: usize, options: &'a Options, ids: bool) -> Result<Self> {
        checked(options.size)?;
        let field = &fields[index];
        let chart = field.chart.as_ref().map_err(|why| {
            Error::failed(format!("field `{}` has no chart to draw: {why}", field.name)).at(&body.name)
        })?;
        let mut places = vec![DVec3::NAN; body.taxels.len()];
        field.members.iter().for_each(|member| places[member.taxel] = member.place.with_z(0.0));
        let held: Vec<usize> = field.members.iter().map(|member| member.taxel).collect();
        // A single taxel is drawn with its area.
        let side = held.iter().map(|&taxel| body.taxels[taxel].area.sqrt()).fold(0.0, f64::max);
        let extent = field.radius_m().max(10.0 * side);
        let dots = Dots::at(held.iter().map(|&taxel| places[taxel]).collect(), vec![DVec3::Z; held.len()], extent);
        let kind = format!("{:?}", chart.kind).to_lowercase();
        let taxels = counted(field.members.len(), "taxel");
        let about = format!(" · {taxels}, {kind} chart, distortion {:.1} %", 100.0 * chart.distortion);
        let reach = |(&p, &r): (&DVec3, &f64)| [p - MARGIN_RADII * r, p + MARGIN_RADII * r];
        let around = dots.places.iter().zip(&dots.radii).flat_map(reach).chain([DVec3::ZERO]).collect();
        let labelled = held.iter().filter(|_| ids).map(|&taxel| body.taxels[taxel].id.to_string());
        let ids = labelled.collect();
        Ok(Self { options, name: field.name.clone(), about, held, dots, around, ids })
    }

    /// In the colours of `fields`, those of the body.
    ///
    /// # Errors
    /// As [`of_chart`].
    pub fn of_fields(&self, fields: &[Field]) -> Result<Picture> {
        // The fields with the chart's member indices.
        let within: Vec<Field> = fields
            .iter()
            .map(|field| {
                let mut field = field.clone();
                field.members.retain_mut(|member| match self.held.binary_search(&member.taxel) {
                    Ok(place) => {
                        member.taxel = place;
                        true
                    }
                    Err(_) => false,
                });
                field
            })
            .collect();
        let shown = FieldColours::for_fields(&within, &self.options.fields, &self.dots);
        let slices = |rims: bool| self.dots.slices(&shown.coloured(&within), DVec3::ZERO, rims);
        let title = format!("{}{}", self.name, self.about);
        self.drawn(&title, shown.key(&within), slices, |_| PAPER, |_| {})
    }

    /// With the pressures of `moment`; taxels of a touch have a rim of its colour.
    ///
    /// # Errors
    /// As [`of_chart`].
    pub fn draw(&self, moment: &Moment<'_>) -> Result<Picture> {
        let of_body = moment.colours();
        let colours: Vec<[u8; 3]> = self.held.iter().map(|&taxel| of_body[taxel]).collect();
        let mut touched = vec![None; self.held.len()];
        for marked in moment.touches {
            for place in marked.taxels.iter().filter_map(|taxel| self.held.binary_search(taxel).ok()) {
                touched[place] = Some(own_colour(&marked.touch));
            }
        }
        let time = moment.t_s.map_or(String::new(), |t_s| format!("{t_s:.2} s"));
        let slices = |rims: bool| self.dots.flat_slices(&colours, &touched, DVec3::ZERO, rims);
        // The colours of pressure replace all others.
        self.drawn(
            &self.name,
            vec![(None, time)],
            slices,
            |place| colours[place],
            |labels| {
                moment.legend().into_iter().for_each(|legend| labels.colours(Legend { note: String::new(), ..legend }));
            },
        )
    }

    /// The discs that `slices` gives, with or without rims, over a legend of `key` and what else `label` adds; ids stand on `colour` of
    /// their place.
    fn drawn(
        &self,
        title: &str,
        key: Vec<(Option<[u8; 3]>, String)>,
        slices: impl Fn(bool) -> Vec<Slice>,
        colour: impl Fn(usize) -> [u8; 3],
        label: impl Fn(&mut Labels),
    ) -> Result<Picture> {
        let mut labels = Labels::new(title, self.options.size[0]);
        let views = [View::Front.axes()];
        let (arrangement, size) = arranged(&mut labels, key, self.options.size, &views, &self.around)?;
        let usual = self.dots.mean_radius() * arrangement.scale;
        let drawing = Drawing {
            size,
            background: linear(PAPER),
            slices: slices(usual > 2.0),
            fan: fan(usual),
            eyes: arrangement.eyes(1.1 * self.around.iter().map(|p| p.length()).fold(1e-9, f64::max)),
            ..Drawing::default()
        };
        let mut pixels = raster::draw(&drawing)?;
        labels.axes(arrangement.pixel(0, DVec3::ZERO));
        labels.bar(arrangement.scale);
        label(&mut labels);
        labels.draw(&mut pixels, size)?;
        let placed = self.ids.iter().enumerate();
        let placed =
            placed.map(|(place, id)| PlacedId { id, at: self.place_of_id(&arrangement, place), on: colour(place) });
        labels::write_ids(&mut pixels, size, &placed.collect::<Vec<_>>())?;
        Ok(Picture { size, pixels })
    }

    /// The pixel that the id of a taxel is about: beside the origin, where the axes would cover it.
    fn place_of_id(&self, arrangement: &Arrangement, place: usize) -> [f64; 2] {
        let [half_width, half_height] = half_of_id(&self.ids[place]);
        let [x, y] = arrangement.pixel(0, self.dots.places[place]);
        let [from_x, from_y] = arrangement.pixel(0, DVec3::ZERO);
        let reach = [half_width + AXIS, half_height + AXIS];
        if (x - from_x).abs() < reach[0] && (y - from_y).abs() < reach[1] {
            return [from_x - reach[0], from_y + reach[1]];
        }
        [x, y]
    }
}
