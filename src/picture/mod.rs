//! Pictures of bodies: from several sides at one scale, each taxel a disc in its field's colour. Drawn on a GPU or a
//! software adapter, without a window.

mod arrows;
mod chart;
mod colour;
mod drawn;
mod edges;
mod labels;
mod moments;
mod outlines;
mod shape;
mod touch;
mod view;

use std::path::Path;

use glam::DVec3;

#[doc(hidden)]
pub use chart::ChartPicture;
pub use chart::of_chart;
pub use drawn::Picture;
pub use moments::{Moments, Times, letters_of, shown_letter, usual_letter};
pub use touch::{MarkedTouch, Moment, TouchPicture};
pub use view::View;

use self::colour::{PALETTE, PAPER, REST, RIM as DARK, linear};
use self::edges::Lines;
use self::labels::Labels;
use self::outlines::Outlines;
use self::shape::{Dots, RIM};
use self::view::Arrangement;
use crate::backend::gpu::raster::{self, Corner, Drawing};
use crate::body::Body;
use crate::error::{Error, Result, nearest};
use crate::field::Field;

/// Minimum width of a picture, pixels, for its title.
const MIN_WIDTH: u32 = 240;

/// Options of a picture.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Width and maximum height, pixels.
    pub size: [u32; 2],
    /// The views; empty for the four that show most.
    pub views: Vec<View>,
    /// Indices of the fields to colour; empty for all without children.
    pub fields: Vec<usize>,
    /// The field or link that fills the picture; all of the body without one.
    pub look_at: Option<String>,
    /// Whether lines connect neighbouring taxels.
    pub edges: bool,
}

/// A picture of `body` and its `fields`, which may be none.
///
/// A taxel in several of the fields has a slice of each colour; one in none is pale. Up to twelve fields have their own
/// colours and are named; of more, neighbouring fields differ.
///
/// # Errors
/// There is nothing to draw, no adapter, a size that cannot be drawn, or a device that stopped answering.
pub fn of_body(body: &Body, fields: &[Field], options: &Options) -> Result<Picture> {
    let dots = Dots::from_body(body).of_all_kinds(body.taxels.iter());
    let shown = FieldColours::for_fields(fields, &options.fields, &dots);
    let title = format!("{} · {}", stem(&body.name), counted(body.taxels.len(), "taxel"));
    let prepared = Prepared::new(body, dots, (fields, options), &title, shown.key(fields))?;
    let Prepared { dots, size, middle, arrangement, views, .. } = &prepared;
    let mut drawing = prepared.drawing(linear(PAPER));
    drawing.slices = dots.slices(&shown.coloured(fields), *middle, prepared.usual_radius() > 2.0);
    let mut pixels = raster::draw(&drawing)?;
    let own = shown.of_taxels(fields, body.taxels.len());
    prepared.outlines.draw(|taxel| [own[taxel], DARK], *size, &mut pixels)?;
    if options.edges {
        prepared.edges(body).draw(*size, &mut pixels)?;
    }
    let mut labels = Labels::new(&title, size[0]);
    labels.key(shown.key(fields), options.size);
    for (view, placed) in views.iter().zip(&arrangement.views) {
        let [left, top, width, _] = placed.part;
        labels.caption(view.word(), [left + width / 2, top.saturating_sub(labels.above_view() / 2)]);
    }
    labels.bar(arrangement.scale);
    labels.draw(&mut pixels, *size)?;
    Ok(Picture { size: *size, pixels })
}

/// A body's surface, discs and views, at their places in a picture.
struct Prepared {
    dots: Dots,
    views: Vec<View>,
    middle: DVec3,
    arrangement: Arrangement,
    size: [u32; 2],
    /// Of taxels under something thin.
    outlines: Outlines,
    /// Around all that is drawn, m.
    radius_m: f64,
    corners: Vec<Corner>,
    faces: Vec<[u32; 3]>,
}

impl Prepared {
    /// For a picture of `body` and its `dots` with this title and key.
    fn new(
        body: &Body,
        dots: Dots,
        (fields, options): (&[Field], &Options),
        title: &str,
        key: Vec<(Option<[u8; 3]>, String)>,
    ) -> Result<Self> {
        let size = checked(options.size)?;
        let triangles = body.triangles_at_rest();
        let bounds = || triangles.iter().flat_map(|(_, corners)| *corners).chain(dots.places.iter().copied());
        let (low, high) = bounds().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        if !(low.is_finite() && high.is_finite()) {
            return Err(Error::failed("it has neither surface nor taxels to draw").at(&body.name));
        }
        let middle = (low + high) / 2.0;
        let looked_at = options.look_at.as_deref().map(|name| look_at(body, fields, name)).transpose()?;
        let views = match &looked_at {
            _ if !options.views.is_empty() => options.views.clone(),
            Some(taxels) => best_of(body, &dots, taxels),
            None => View::best(&dots.normals),
        };
        let axes: Vec<[DVec3; 3]> = views.iter().map(|view| view.axes()).collect();
        // Include the discs and their rims.
        let reach = |taxel: usize| {
            let (place, reach) = (dots.places[taxel] - middle, RIM * dots.radii[taxel]);
            // All corners of the cube around it: views may be aslant.
            [-reach, reach].into_iter().flat_map(move |x| {
                [-reach, reach].into_iter().flat_map(move |y| [-reach, reach].map(|z| place + DVec3::new(x, y, z)))
            })
        };
        let all = (0..dots.places.len()).flat_map(reach);
        let points: Vec<DVec3> = triangles.iter().flat_map(|(_, c)| c.map(|p| p - middle)).chain(all).collect();
        let in_sight = match looked_at {
            None => points.clone(),
            Some(taxels) => taxels.into_iter().flat_map(reach).collect(),
        };
        let mut labels = Labels::new(title, size[0]);
        let (arrangement, size) = arranged(&mut labels, key, size, &axes, &in_sight)?;
        let radius_m = 1.1 * points.iter().map(|p| p.length()).fold(0.0, f64::max).max(1e-9);
        let (corners, faces) = shape::surface(&triangles, middle);
        let outlines = Outlines::new(body, &dots, &views, &arrangement, middle);
        Ok(Self { dots, views, middle, arrangement, size, outlines, radius_m, corners, faces })
    }

    /// The lines between neighbouring taxels.
    fn edges(&self, body: &Body) -> Lines {
        let thick = if self.usual_radius() > 4.0 { 2 } else { 1 };
        Lines::new(body, &self.dots, &self.views, &self.arrangement, self.middle, thick)
    }

    /// Radius of a usual disc, pixels.
    fn usual_radius(&self) -> f64 {
        self.dots.mean_radius() * self.arrangement.scale
    }

    /// The surface without discs.
    fn drawing(&self, background: [f64; 3]) -> Drawing {
        Drawing {
            size: self.size,
            background,
            corners: self.corners.clone(),
            triangles: self.faces.clone(),
            slices: Vec::new(),
            fan: fan(self.usual_radius()),
            eyes: self.arrangement.eyes(self.radius_m),
        }
    }
}

/// The taxels that a picture is of: those of the field whose chart it is, or of what it looks at; all if neither is asked for.
///
/// # Errors
/// There is no such field or link with taxels.
pub fn part_of(body: &Body, fields: &[Field], charted: Option<usize>, looked_at: Option<&str>) -> Result<Vec<usize>> {
    match (charted, looked_at) {
        (Some(index), _) => Ok(fields[index].members.iter().map(|member| member.taxel).collect()),
        (None, Some(name)) => look_at(body, fields, name),
        (None, None) => Ok((0..body.taxels.len()).collect()),
    }
}

/// The taxels of the field or the link called `name`.
fn look_at(body: &Body, fields: &[Field], name: &str) -> Result<Vec<usize>> {
    if let Some(field) = fields.iter().find(|field| field.name == name) {
        return Ok(field.members.iter().map(|member| member.taxel).collect());
    }
    let link = body.link_index(name);
    let taxels: Vec<usize> = (0..body.taxels.len()).filter(|&i| Some(body.taxels[i].link) == link).collect();
    if !taxels.is_empty() {
        return Ok(taxels);
    }
    let names = fields.iter().map(|field| field.name.as_str()).chain(body.links.iter().map(|link| link.name.as_str()));
    let hint = nearest(name, names).map_or(String::new(), |near| format!("; did you mean `{near}`?"));
    Err(Error::usage(format!("there is no field or link `{name}` with taxels{hint}")).at(&body.name))
}

/// The views that show most of these `taxels`: those that nothing hides, or if all are hidden those that look at them.
fn best_of(body: &Body, dots: &Dots, taxels: &[usize]) -> Vec<View> {
    let seen = edges::seen(body, dots, View::ALL);
    let shows = |view: View| {
        let Some(index) = View::ALL.iter().position(|other| *other == view) else { return 0.0 };
        let in_view = taxels.iter().filter(|&&taxel| seen[index][taxel]);
        view.seen(&in_view.map(|&taxel| dots.normals[taxel]).collect::<Vec<_>>())
    };
    let best = View::best_of(shows);
    if !best.is_empty() {
        return best;
    }
    View::best(&taxels.iter().map(|&taxel| dots.normals[taxel]).collect::<Vec<_>>())
}

/// Views of `points` above a legend of `key` in a picture of at most `size`, and the picture's size.
fn arranged(
    labels: &mut Labels,
    key: Vec<(Option<[u8; 3]>, String)>,
    [width, height]: [u32; 2],
    views: &[[DVec3; 3]],
    points: &[DVec3],
) -> Result<(Arrangement, [u32; 2])> {
    let taken = labels.above() + labels.key(key, [width, height]);
    if height <= taken + 40 {
        let least = taken + 40;
        return Err(Error::usage(format!("the picture is too low; give a height over {least} pixels")));
    }
    let arrangement = Arrangement::in_rows(views, points, [width, height - taken], labels.above(), labels.above_view());
    let size = [width, arrangement.height + taken];
    Ok((arrangement, size))
}

fn checked(size: [u32; 2]) -> Result<[u32; 2]> {
    if size[0] < MIN_WIDTH || size.iter().any(|&side| side > raster::LONGEST_SIDE) {
        return Err(Error::usage(format!(
            "a picture of {} × {} pixels cannot be drawn; give a width of {MIN_WIDTH} at least, and sides up to {}",
            size[0],
            size[1],
            raster::LONGEST_SIDE
        )));
    }
    Ok(size)
}

struct FieldColours {
    /// Their indices.
    fields: Vec<usize>,
    /// Their colours, indices into the palette.
    colours: Vec<usize>,
    /// Whether all colours differ.
    own: bool,
}

impl FieldColours {
    /// Colours of the fields `chosen`, or else of the fields without children.
    fn for_fields(fields: &[Field], chosen: &[usize], dots: &Dots) -> Self {
        let leaf = |index: &usize| fields.iter().all(|field| field.parent != Some(*index));
        let fields_shown: Vec<usize> = match chosen {
            [] => (0..fields.len()).filter(leaf).collect(),
            chosen => chosen.to_vec(),
        };
        let fields_shown: Vec<usize> =
            fields_shown.into_iter().filter(|&index| !fields[index].members.is_empty()).collect();
        let shown: Vec<&Field> = fields_shown.iter().map(|&index| &fields[index]).collect();
        let beside = if shown.len() > PALETTE.len() { dots.beside(&shown) } else { Default::default() };
        let (colours, own) = colour::assign(shown.len(), &beside);
        Self { fields: fields_shown, colours, own }
    }

    fn coloured<'a>(&self, fields: &'a [Field]) -> Vec<(&'a Field, [u8; 3])> {
        self.fields.iter().zip(&self.colours).map(|(&index, &colour)| (&fields[index], PALETTE[colour])).collect()
    }

    /// By taxel of `count`, the colour of the first field that has it.
    fn of_taxels(&self, fields: &[Field], count: usize) -> Vec<[u8; 3]> {
        let mut colours = vec![REST; count];
        for (field, colour) in self.coloured(fields).into_iter().rev() {
            field.members.iter().for_each(|member| colours[member.taxel] = colour);
        }
        colours
    }

    /// The legend's entries.
    fn key(&self, fields: &[Field]) -> Vec<(Option<[u8; 3]>, String)> {
        if self.own {
            let named = self.coloured(fields);
            return named.into_iter().map(|(field, colour)| (Some(colour), field.name.clone())).collect();
        }
        let text =
            format!("{} fields in {} colours; fields beside each other differ", self.fields.len(), PALETTE.len());
        vec![(None, text)]
    }
}

/// Number of triangles of a disc of `radius` pixels: its outline is at most a quarter of a pixel off.
fn fan(radius: f64) -> u32 {
    (4.5 * radius.max(0.0).sqrt() + 6.0).min(256.0) as u32
}

/// The file's name without folder and extension.
fn stem(name: &str) -> &str {
    Path::new(name).file_stem().and_then(|stem| stem.to_str()).unwrap_or(name)
}

fn counted(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}
