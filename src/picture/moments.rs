//! Pictures of recorded touches: which of its frames they show, and what is drawn of each.

use glam::DVec3;

use super::{ChartPicture, MarkedTouch, Moment, Options, Picture, TouchPicture, View};
use crate::body::Body;
use crate::engine::Engine;
use crate::error::{Error, Result};
use crate::field::Field;
use crate::percept::{Touch, TouchFrame, TouchTrails};
use crate::scene::{SenseRanges, SensedTaxels, SensedValue};
use crate::signal::{Frame, Letter, Quantity, Reading, Receptor};

/// Pictures of an animation at most: each is held in memory.
const MAX_PICTURES: usize = 1000;

/// The times of a recording that pictures show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Times {
    /// The first at which there is most to see of the letter: most is pressed or pulled, it is warmest, or something is nearest.
    Most,
    /// The last frame up to this time, s.
    At(f64),
    /// An animation.
    Span {
        /// Its first time, s.
        from_s: f64,
        /// Its last time, s.
        to_s: f64,
        /// Pictures a second.
        rate_hz: f64,
    },
}

impl Times {
    /// Refuses a rate that is none.
    ///
    /// # Errors
    /// It is not above 0 and up to 100 Hz.
    pub fn check(self) -> Result<()> {
        match self {
            Self::Span { rate_hz, .. } if !(rate_hz > 0.0 && rate_hz <= 100.0) => {
                Err(Error::usage(format!("{rate_hz} is not a rate of pictures; give up to 100 Hz")))
            }
            _ => Ok(()),
        }
    }

    /// Why no frame of the recording is shown, whose least and greatest times are `span_s`, if it has frames.
    fn missed(self, span_s: Option<[f64; 2]>) -> String {
        let Some([first_s, last_s]) = span_s else { return "the recording has no frames".to_owned() };
        let asked = match self {
            Self::Most => String::new(),
            Self::At(t_s) => format!(" up to {t_s} s"),
            Self::Span { from_s, to_s, .. } if to_s == f64::INFINITY => format!(" from {from_s} s on"),
            Self::Span { from_s, to_s, .. } if from_s == f64::NEG_INFINITY => format!(" up to {to_s} s"),
            Self::Span { from_s, to_s, .. } => format!(" from {from_s} to {to_s} s"),
        };
        format!("the recording has no frames{asked}; give a time of its own, from {first_s} to {last_s} s")
    }

    /// How long an animation shows each picture, s.
    #[must_use]
    pub fn picture_s(self) -> f64 {
        if let Self::Span { rate_hz, .. } = self { 1.0 / rate_hz } else { 1.0 }
    }
}

/// What is shown of one frame.
struct Shown {
    t_s: f64,
    /// By taxel, whether it is pressed.
    pressed: Vec<bool>,
    /// By taxel, as [`Moment::values`], in SI units.
    values: Vec<Option<f64>>,
    shear: Vec<(usize, DVec3)>,
    touches: Vec<MarkedTouch>,
}

/// What pictures show of a recording.
pub struct Moments {
    shown: Vec<Shown>,
    letter: Receptor,
    /// Of the colours, in SI units: up to the largest pressure or tangential force of the whole recording, 1 where there is none; of
    /// temperatures and distances those of the calibration, or all that was read.
    ends: [f64; 2],
    quantity: Quantity,
}

somatic_skin::debug_by_name!(Moments);

impl Moments {
    /// Runs all `frames` of the recording called `name` through `engine`, which looks for touches of `body` ([`crate::Scene::touches`])
    /// and leaves them in their links' frames, and keeps what is shown of `times`: of taxels what `letter` is made of, which the engine
    /// reads ([`letters_of`]). There is most to see when there is most of `part`, the taxels that pictures are of
    /// ([`part_of`](super::part_of)).
    ///
    /// # Errors
    /// What reading and computing say; there is no frame at these times, or there are too many.
    pub fn compute(
        engine: &mut Engine,
        body: &Body,
        (letter, times, part): (Receptor, Times, &[usize]),
        name: &str,
        frames: impl Iterator<Item = Result<Frame>>,
    ) -> Result<Self> {
        times.check()?;
        let senses = SensedTaxels::new(engine.plan(), body);
        let (mut sensed, mut ranges) = (Vec::new(), SenseRanges::default());
        engine.keep_touch_taxels(true);
        let is_of_skin = |taxel: &usize| body.taxels[*taxel].modality.is_pressed();
        let mut is_part = vec![false; body.taxels.len()];
        part.iter().for_each(|&taxel| is_part[taxel] = true);
        let of_skin: Vec<usize> = (0..body.taxels.len()).filter(is_of_skin).collect();
        let mut trails = TouchTrails::default();
        let (from_s, to_s) = match times {
            Times::Most => (f64::NEG_INFINITY, f64::INFINITY),
            Times::At(t_s) => (f64::NEG_INFINITY, t_s),
            Times::Span { from_s, to_s, .. } => (from_s, to_s),
        };
        let (mut shown, mut max_force) = (Vec::<Shown>::new(), 0.0_f64);
        let (mut next_s, mut most) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        let mut list = Vec::new();
        let mut span_s: Option<[f64; 2]> = None;
        for frame in frames {
            let frame = frame?;
            span_s = Some(span_s.map_or([frame.t_s; 2], |[l, m]| [l.min(frame.t_s), m.max(frame.t_s)]));
            engine.process_one(&frame)?;
            let found = engine.percepts().touches(0);
            found.iter().for_each(|found| trails.follow(frame.t_s, found));
            engine.pressures(&frame, &mut list);
            engine.sensed(&frame, &senses, &mut sensed);
            sensed.iter().for_each(|value| ranges.see(value));
            let forces = || forces_of(body, letter, &list, &sensed);
            max_force = forces().map(|(_, force)| force).fold(max_force, f64::max);
            let to_see = match letter {
                Receptor::Temperature | Receptor::Proximity => extreme(letter, &sensed, &is_part),
                _ => forces().filter(|(taxel, _)| is_part[*taxel]).map(|(_, force)| force).sum(),
            };
            if !(from_s..=to_s).contains(&frame.t_s) {
                continue;
            }
            let is_due = match times {
                Times::Most => to_see > most,
                Times::At(_) => true,
                // A picture may be early by less than recordings tell times apart.
                Times::Span { .. } => frame.t_s >= next_s - 1e-6,
            };
            if !is_due {
                continue;
            }
            most = to_see;
            match times {
                Times::Span { .. } if shown.len() == MAX_PICTURES => {
                    let what = format!("over {MAX_PICTURES} pictures; choose a shorter part or a lower rate");
                    return Err(Error::usage(what));
                }
                Times::Span { rate_hz, .. } => {
                    next_s = if next_s.is_finite() { next_s } else { frame.t_s } + 1.0 / rate_hz;
                }
                Times::Most | Times::At(_) => shown.clear(),
            }
            let touches = found.map_or_else(Vec::new, |found| marked(found, &trails, &of_skin));
            shown.push(Shown { t_s: frame.t_s, touches, ..read(body, letter, &list, &sensed) });
        }
        if shown.is_empty() {
            return Err(Error::usage(times.missed(span_s)).at(name));
        }
        let quantity = engine.plan().common_quantity().unwrap_or_default();
        let ends = ends_of(letter, &SenseRanges::of_calibration(engine.plan(), &senses), &ranges, max_force);
        Ok(Self { shown, letter, ends, quantity })
    }

    /// Draws them on `body`, by default from the one or two sides that show most of the touch, or of what is shown, or as a body without a
    /// recording if that is nothing; `progress` gets the share that is done and says whether to go on.
    ///
    /// # Errors
    /// As [`super::of_body`]; or `progress` has ended it.
    pub fn draw(
        &self,
        body: &Body,
        fields: &[Field],
        options: &Options,
        ids: bool,
        progress: impl FnMut(f64) -> bool,
    ) -> Result<Vec<Picture>> {
        let mut options = options.clone();
        // A part of a body has the views that show it.
        if options.views.is_empty() && options.look_at.is_none() {
            options.views = self.views(body);
        }
        let picture = TouchPicture::new(body, fields, &options, ids)?;
        self.drawn(|moment| picture.draw(moment), progress)
    }

    /// The views of `body` that show most of what there is to see; if that is nothing, of the taxels of the letter.
    fn views(&self, body: &Body) -> Vec<View> {
        let is_force = !matches!(self.letter, Receptor::Temperature | Receptor::Proximity);
        let is_to_see = |shown: &Shown, taxel: usize| match is_force {
            true => shown.pressed[taxel],
            false => shown.values[taxel].is_some_and(f64::is_finite),
        };
        let normals = |is_of: &dyn Fn(usize) -> bool| {
            let taxels = body.taxels.iter().enumerate().filter(|&(taxel, _)| is_of(taxel));
            let normal = |link: usize, in_link: DVec3| body.links[link].body_from_link.transform_vector3(in_link);
            taxels.map(|(_, taxel)| normal(taxel.link, taxel.normal_in_link)).collect::<Vec<_>>()
        };
        let to_see = normals(&|taxel| self.shown.iter().any(|shown| is_to_see(shown, taxel)));
        if to_see.is_empty() {
            return View::best(&normals(&|taxel| self.letter.reads(body.taxels[taxel].modality)));
        }
        View::two_best(&to_see)
    }

    /// Draws them on the chart of field `index` of `fields`; else as [`Moments::draw`].
    ///
    /// # Errors
    /// As [`super::of_chart`]; the field has no taxels of the letter; or `progress` has ended it.
    pub fn draw_chart(
        &self,
        body: &Body,
        (fields, index): (&[Field], usize),
        options: &Options,
        ids: bool,
        progress: impl FnMut(f64) -> bool,
    ) -> Result<Vec<Picture>> {
        let field = &fields[index];
        if !field.members.iter().any(|member| self.letter.reads(body.taxels[member.taxel].modality)) {
            let what = format!("no taxel of field `{}` measures what letter `{}` shows", field.name, self.letter);
            return Err(Error::usage(format!("{what}; choose another field or letter")).at(&body.name));
        }
        let picture = ChartPicture::new(body, fields, index, options, ids)?;
        self.drawn(|moment| picture.draw(moment), progress)
    }

    fn drawn(
        &self,
        draw: impl Fn(&Moment<'_>) -> Result<Picture>,
        mut progress: impl FnMut(f64) -> bool,
    ) -> Result<Vec<Picture>> {
        let (factor, unit) = match self.letter {
            Receptor::Temperature => (1.0, "°C"),
            Receptor::Proximity => (1e3, "mm"),
            _ => self.quantity.readable(self.ends[1]),
        };
        let ends = Some(self.ends.map(|end| end * factor));
        let mut pictures = Vec::with_capacity(self.shown.len());
        for (index, Shown { t_s, values, shear, touches, .. }) in self.shown.iter().enumerate() {
            let values: Vec<Option<f64>> = values.iter().map(|value| value.map(|value| value * factor)).collect();
            let shear: Vec<(usize, DVec3)> = shear.iter().map(|&(taxel, force)| (taxel, force * factor)).collect();
            let (letter, t_s) = (self.letter, Some(*t_s));
            pictures.push(draw(&Moment { letter, values: &values, ends, unit, shear: &shear, touches, t_s })?);
            if !progress((index + 1) as f64 / self.shown.len() as f64) {
                return Err(Error::failed("stopped before all was drawn"));
            }
        }
        Ok(pictures)
    }
}

/// The ends of the colours of `letter`: of temperatures and distances as they are `calibrated`, or else all that was `read`; of forces up
/// to `most`.
fn ends_of(letter: Receptor, calibrated: &SenseRanges, read: &SenseRanges, most: f64) -> [f64; 2] {
    let known = match letter {
        Receptor::Temperature => calibrated.celsius.or(read.celsius),
        Receptor::Proximity => calibrated.distance_m.or(read.distance_m).map(|[_, most]| [0.0, most]),
        _ => Some([0.0, most]),
    };
    match known.unwrap_or_default() {
        [least, most] if least < most => [least, most],
        [least, _] => [least, least + 1.0],
    }
}

/// The letter that a word names; pressure itself is called so, too.
///
/// # Errors
/// It names none, or changes, which are not drawn.
pub fn shown_letter(word: &str) -> Result<Receptor> {
    match word {
        "pressure" => Ok(Receptor::Sustained),
        word => match word.parse()? {
            Receptor::Change => {
                Err(Error::usage("changes are not drawn; give pressure, shear, temperature or proximity"))
            }
            receptor => Ok(receptor),
        },
    }
}

/// The letter that is shown of `body` unless another is asked for: pressure, or else what its taxels in `fields` measure.
#[must_use]
pub fn usual_letter(body: &Body, fields: &[Field]) -> Receptor {
    let all = [Receptor::Sustained, Receptor::Temperature, Receptor::Proximity];
    all.into_iter().find(|letter| has_taxels(body, fields, *letter)).unwrap_or_default()
}

/// Whether a taxel of `body` in `fields` measures what `letter` is made of.
fn has_taxels(body: &Body, fields: &[Field], letter: Receptor) -> bool {
    fields.iter().flat_map(|field| &field.members).any(|member| letter.reads(body.taxels[member.taxel].modality))
}

/// The letters that an engine must read for pictures of `letter`: that one, pressures for touches, and shear for arrows, where the
/// `fields` of `body` have such taxels.
#[must_use]
pub fn letters_of(body: &Body, fields: &[Field], letter: Receptor) -> Vec<Letter> {
    let read = [Receptor::Sustained, Receptor::Shear, Receptor::Temperature, Receptor::Proximity];
    let is_read = |receptor: &Receptor| match receptor {
        Receptor::Sustained | Receptor::Shear => has_taxels(body, fields, *receptor) || *receptor == letter,
        other => *other == letter,
    };
    read.into_iter().filter(is_read).map(|receptor| Letter { receptor, ..Letter::default() }).collect()
}

/// The sizes of the forces that `letter` is made of, each with its taxel: `list` has pressures by id, `sensed` all else.
fn forces_of<'a>(
    body: &'a Body,
    letter: Receptor,
    list: &'a [(u32, f64)],
    sensed: &'a [SensedValue],
) -> impl Iterator<Item = (usize, f64)> + 'a {
    let is_shear = letter == Receptor::Shear;
    let pressures = list.iter().filter(move |_| !is_shear);
    let pulls = sensed.iter().filter(move |value| is_shear && value.receptor == letter);
    let pressures = pressures.filter_map(|&(id, pressure)| Some((body.taxel_index(id)?, pressure)));
    pressures.chain(pulls.map(|value| (value.taxel, libm::hypot(value.shear[0], value.shear[1]))))
}

/// How warm the warmest of `sensed` is, of taxels that are part of the picture, or how near the nearest, in a number that grows with it.
fn extreme(letter: Receptor, sensed: &[SensedValue], is_part: &[bool]) -> f64 {
    let own = sensed.iter().filter(|value| value.receptor == letter && is_part[value.taxel]);
    let own = own.filter_map(|value| match value.reading {
        Reading::Value(number, _) if letter == Receptor::Temperature => Some(number),
        Reading::Value(number, true) => Some(-number),
        _ => None,
    });
    own.fold(f64::MIN, f64::max)
}

/// What is shown of taxels in a frame: `list` has pressures by id, `sensed` all else.
fn read(body: &Body, letter: Receptor, list: &[(u32, f64)], sensed: &[SensedValue]) -> Shown {
    let (mut values, mut pressed) = (vec![None; body.taxels.len()], vec![false; body.taxels.len()]);
    for &(id, pressure) in list {
        if let Ok(taxel) = body.taxels.binary_search_by_key(&id, |taxel| taxel.id) {
            pressed[taxel] = pressure > 0.0;
            values[taxel] = Some(pressure).filter(|_| letter == Receptor::Sustained);
        }
    }
    let mut shear = Vec::new();
    for value in sensed {
        if value.receptor == letter {
            values[value.taxel] = match value.reading {
                // Nothing is near.
                Reading::Value(_, false) if letter == Receptor::Proximity => Some(f64::INFINITY),
                Reading::Value(number, _) => Some(number),
                Reading::Missing | Reading::Faulty => None,
            };
        }
        if value.receptor == Receptor::Shear {
            let [one, two] = body.taxels[value.taxel].tangents_in_link();
            shear.push((value.taxel, value.shear[0] * one + value.shear[1] * two));
        }
    }
    Shown { t_s: 0.0, pressed, values, shear, touches: Vec::new() }
}

/// The touches of a frame with their trails; `of_skin` are the taxels of the skin's nodes.
fn marked(found: &TouchFrame, trails: &TouchTrails, of_skin: &[usize]) -> Vec<MarkedTouch> {
    let of_touch = |touch: &Touch| MarkedTouch {
        touch: touch.clone(),
        taxels: found.taxels(touch).iter().map(|&node| of_skin[node as usize]).collect(),
        trail: trails.trail(touch.id).filter_map(|point| Some((point.link?, point.position))).collect(),
    };
    found.touches.iter().map(of_touch).collect()
}
