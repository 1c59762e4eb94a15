//! Pictures of the chart of a field: its taxels laid flat, in the colours of fields or of pressures.

use glam::{DVec2, DVec3};

use super::colour::{PAPER, linear};
use super::labels::{self, Labels, PlacedId, half_of_id};
use super::shape::{Disc, DiscKind, Dots, RIM};
use super::touch::Moment;
use super::view::{Arrangement, View};
use super::{FieldColours, Options, Picture, arranged, arrows, checked, counted, fan};
use crate::backend::gpu::raster::{self, Drawing, Slice};
use crate::body::{Body, Modality};
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
    /// By taxel of the body.
    modalities: Vec<Modality>,
    /// By place in the chart, the axes x, y and z of the taxel's link along u and v, as its tangents lie in the chart.
    link_axes: Vec<[DVec2; 3]>,
    /// For the colours of fields; with ids, each as large as any kind leaves room for.
    dots: Dots,
    /// For what taxels read, each as large as its own kind leaves room for; with ids, as any kind.
    dots_by_kind: Dots,
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
        let link_axes = |&taxel: &usize| {
            let taxel = &body.taxels[taxel];
            let anchor_from_link = match field.anchor {
                Some(anchor) => body.rest_transform(anchor, taxel.link),
                None => body.links[taxel.link].world_from_link(),
            };
            let normal = anchor_from_link.transform_vector3(taxel.normal_in_link);
            DVec3::AXES.map(|axis| chart.along(anchor_from_link.transform_vector3(axis), normal))
        };
        // A single taxel is drawn with its area.
        let side = held.iter().map(|&taxel| body.taxels[taxel].area.sqrt()).fold(0.0, f64::max);
        let extent = field.radius_m().max(10.0 * side);
        let dots = Dots::at(held.iter().map(|&taxel| places[taxel]).collect(), vec![DVec3::Z; held.len()], extent);
        let kinds = held.iter().map(|&taxel| &body.taxels[taxel]);
        // No disc may cover the id of another.
        let [dots, dots_by_kind] = match ids {
            true => [dots.clone(), dots],
            false => [dots.clone().of_all_kinds(kinds.clone()), dots.by_kind(kinds)],
        };
        let kind = format!("{:?}", chart.kind).to_lowercase();
        let taxels = counted(field.members.len(), "taxel");
        let about = format!(" · {taxels}, {kind} chart, distortion {:.1} %", 100.0 * chart.distortion);
        let reach = |(place, &p): (usize, &DVec3)| {
            let around = (MARGIN_RADII * dots.radii[place]).max(RIM * dots_by_kind.radii[place]);
            [p - around, p + around]
        };
        let around = dots.places.iter().enumerate().flat_map(reach).chain([DVec3::ZERO]).collect();
        let labelled = held.iter().filter(|_| ids).map(|&taxel| body.taxels[taxel].id.to_string());
        Ok(Self {
            options,
            name: field.name.clone(),
            about,
            modalities: body.taxels.iter().map(|taxel| taxel.modality).collect(),
            link_axes: held.iter().map(link_axes).collect(),
            ids: labelled.collect(),
            held,
            dots,
            dots_by_kind,
            around,
        })
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
        Ok(self.drawn(&title, shown.key(&within), (&self.dots, slices), |_| (PAPER, false), |_, _| {})?.0)
    }

    /// With what taxels read at `moment`, and arrows of tangential forces; taxels of a touch have a rim of its colour.
    ///
    /// # Errors
    /// As [`of_chart`].
    pub fn draw(&self, moment: &Moment<'_>) -> Result<Picture> {
        let of_body = moment.discs(self.modalities.iter().copied(), !self.ids.is_empty());
        let discs: Vec<Disc> = self.held.iter().map(|&taxel| of_body[taxel]).collect();
        let time = moment.t_s.map_or(String::new(), |t_s| format!("{t_s:.2} s"));
        let dots = &self.dots_by_kind;
        let slices = |rims: bool| dots.flat_slices(&discs, DVec3::ZERO, rims);
        let radius_m = dots.mean_radius();
        let held = |&&(taxel, _): &&(usize, DVec3)| self.held.binary_search(&taxel).is_ok();
        let pulled: Vec<(usize, DVec3)> = moment.shear.iter().filter(held).copied().collect();
        let moment = &Moment { shear: &pulled, ..moment.clone() };
        let label = |labels: &mut Labels, arrangement: &Arrangement| {
            moment.legend(&discs).into_iter().for_each(|legend| labels.colours(legend));
            moment.arrow_key(radius_m * arrangement.scale).into_iter().for_each(|key| labels.arrow(key));
        };
        // The colours of what taxels read replace those of fields.
        let (title, key) = (moment.titled(&self.name), vec![(None, time)]);
        let on = |place: usize| (discs[place].colour, discs[place].kind != DiscKind::Shown);
        let (mut picture, arrangement) = self.drawn(&title, key, (dots, slices), on, label)?;
        let Some(most) = moment.shear_ends() else { return Ok(picture) };
        let arrow = |&(taxel, force): &(usize, DVec3)| {
            let place = self.held.binary_search(&taxel).ok()?;
            let from = dots.places[place];
            let along: DVec2 = force.to_array().into_iter().zip(self.link_axes[place]).map(|(x, axis)| x * axis).sum();
            let to = from + along.extend(0.0) * arrows::length(1.0, radius_m, most);
            Some([from, to].map(|end| arrangement.pixel(0, end)))
        };
        arrows::draw(&mut picture.pixels, picture.size, moment.shear.iter().filter_map(arrow))?;
        Ok(picture)
    }

    /// The discs of `dots` that `slices` gives, with or without rims, over a legend of `key` and what else `label` adds; `on` has by place
    /// the colour that its id stands on, and whether that is behind.
    fn drawn(
        &self,
        title: &str,
        key: Vec<(Option<[u8; 3]>, String)>,
        (dots, slices): (&Dots, impl Fn(bool) -> Vec<Slice>),
        on: impl Fn(usize) -> ([u8; 3], bool),
        label: impl Fn(&mut Labels, &Arrangement),
    ) -> Result<(Picture, Arrangement)> {
        let mut labels = Labels::new(title, self.options.size[0]);
        let views = [View::Front.axes()];
        let (arrangement, size) = arranged(&mut labels, key, self.options.size, &views, &self.around)?;
        let usual = dots.mean_radius() * arrangement.scale;
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
        label(&mut labels, &arrangement);
        labels.draw(&mut pixels, size)?;
        let placed = self.ids.iter().enumerate().map(|(place, id)| {
            let (on, is_behind) = on(place);
            PlacedId { id, at: self.place_of_id(&arrangement, place), on, is_behind }
        });
        labels::write_ids(&mut pixels, size, placed.collect())?;
        Ok((Picture { size, pixels }, arrangement))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundled;
    use crate::field::FieldSet;

    /// How far what is along an axis of a taxel's link in the chart is from what a step along it does to the taxel's own place there,
    /// and from having the length of what is tangential in it.
    fn off(name: &str) -> [f64; 2] {
        let body = Body::from_bytes("sensing-hand", bundled::SENSING_HAND).unwrap();
        let fields = FieldSet::new(&body).unwrap().fields;
        let index = fields.iter().position(|field| field.name == name).unwrap();
        let (field, options) = (&fields[index], Options { size: [400, 400], ..Options::default() });
        let picture = ChartPicture::new(&body, &fields, index, &options, false).unwrap();
        let (chart, anchor) = (field.chart.as_ref().unwrap(), field.anchor.unwrap());
        let mut worst = [0.0_f64; 2];
        for (member, axes) in field.members.iter().zip(&picture.link_axes) {
            let taxel = &body.taxels[member.taxel];
            let place = |step: DVec3| {
                let in_anchor = body.rest_transform(anchor, taxel.link).transform_point3(taxel.position_in_link + step);
                chart.project(in_anchor - field.origin_in_anchor).truncate()
            };
            for (tangent, own) in taxel.tangents_in_link().map(|tangent| {
                (tangent, tangent.to_array().into_iter().zip(axes).map(|(x, axis)| x * *axis).sum::<DVec2>())
            }) {
                let step = place(tangent * 1e-4) - place(DVec3::ZERO);
                worst[0] = worst[0].max((own - step * 1e4).length());
                worst[1] = worst[1].max((own.length() - 1.0).abs());
            }
        }
        worst
    }

    #[test]
    fn forces_lie_in_a_chart_as_their_taxels_do_and_keep_their_length() {
        // A back is flat: a step along a tangent is a step along it in the chart.
        let [step, length] = off("hand/back");
        assert!(step < 1e-6 && length < 1e-9, "{step}, {length}");
        // A finger is not: a step is shortened there, and a force is not.
        let [step, length] = off("hand/midhand/index");
        assert!(step > 1e-3 && length < 1e-9, "{step}, {length}");
    }
}
