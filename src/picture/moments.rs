//! Pictures of recorded touches: which of its frames they show, and what is drawn of each.

use super::{ChartPicture, MarkedTouch, Moment, Options, Picture, TouchPicture, View};
use crate::body::Body;
use crate::engine::Engine;
use crate::error::{Error, Result};
use crate::field::Field;
use crate::percept::{Touch, TouchFrame, TouchTrails};
use crate::signal::{Frame, Quantity};

/// Pictures of an animation at most: each is held in memory.
const MAX_PICTURES: usize = 1000;
/// Sides that a touch is shown from, unless others are asked for.
const MAX_SIDES: usize = 2;

/// The times of a recording that pictures show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Times {
    /// The one at which most is pressed.
    MostPressed,
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

    /// How long an animation shows each picture, s.
    #[must_use]
    pub fn picture_s(self) -> f64 {
        if let Self::Span { rate_hz, .. } = self { 1.0 / rate_hz } else { 1.0 }
    }
}

/// What is shown of one frame.
struct Shown {
    t_s: f64,
    pressures: Vec<Option<f64>>,
    touches: Vec<MarkedTouch>,
}

/// What pictures show of a recording.
pub struct Moments {
    shown: Vec<Shown>,
    /// The largest pressure of the whole recording; 1 where nothing is pressed.
    max_pressure: f64,
    quantity: Quantity,
}

somatic_skin::debug_by_name!(Moments);

impl Moments {
    /// Runs all `frames` of the recording called `name` through `engine`, which looks for touches of `body` ([`crate::Scene::touches`])
    /// and leaves them in their links' frames, and keeps what is shown of `times`.
    ///
    /// # Errors
    /// What reading and computing say; there is no frame at these times, or there are too many.
    pub fn compute(
        engine: &mut Engine,
        body: &Body,
        times: Times,
        name: &str,
        frames: impl Iterator<Item = Result<Frame>>,
    ) -> Result<Self> {
        times.check()?;
        engine.keep_touch_taxels(true);
        let is_of_skin = |taxel: &usize| body.taxels[*taxel].modality.is_pressed();
        let of_skin: Vec<usize> = (0..body.taxels.len()).filter(is_of_skin).collect();
        let mut trails = TouchTrails::default();
        let (from_s, to_s) = match times {
            Times::MostPressed => (f64::NEG_INFINITY, f64::INFINITY),
            Times::At(t_s) => (f64::NEG_INFINITY, t_s),
            Times::Span { from_s, to_s, .. } => (from_s, to_s),
        };
        let (mut shown, mut max_pressure) = (Vec::<Shown>::new(), 0.0_f64);
        let (mut next_s, mut most) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        let mut list = Vec::new();
        for frame in frames {
            let frame = frame?;
            engine.process_one(&frame)?;
            let found = engine.percepts().touches(0);
            found.iter().for_each(|found| trails.follow(frame.t_s, found));
            engine.pressures(&frame, &mut list);
            let sum: f64 = list.iter().map(|&(_, pressure)| pressure).sum();
            max_pressure = list.iter().map(|&(_, pressure)| pressure).fold(max_pressure, f64::max);
            if !(from_s..=to_s).contains(&frame.t_s) {
                continue;
            }
            let is_due = match times {
                Times::MostPressed => sum > most,
                Times::At(_) => true,
                // A picture may be early by less than recordings tell times apart.
                Times::Span { .. } => frame.t_s >= next_s - 1e-6,
            };
            if !is_due {
                continue;
            }
            most = sum;
            match times {
                Times::Span { .. } if shown.len() == MAX_PICTURES => {
                    let what = format!("over {MAX_PICTURES} pictures; choose a shorter part or a lower rate");
                    return Err(Error::usage(what));
                }
                Times::Span { rate_hz, .. } => {
                    next_s = if next_s.is_finite() { next_s } else { frame.t_s } + 1.0 / rate_hz;
                }
                Times::MostPressed | Times::At(_) => shown.clear(),
            }
            let mut pressures = vec![None; body.taxels.len()];
            for &(id, pressure) in &list {
                if let Ok(taxel) = body.taxels.binary_search_by_key(&id, |taxel| taxel.id) {
                    pressures[taxel] = Some(pressure);
                }
            }
            let touches = found.map_or_else(Vec::new, |found| marked(found, &trails, &of_skin));
            shown.push(Shown { t_s: frame.t_s, pressures, touches });
        }
        if shown.is_empty() {
            return Err(Error::usage("the recording has no frames at that time").at(name));
        }
        let quantity = engine.plan().common_quantity().unwrap_or_default();
        Ok(Self { shown, max_pressure: if max_pressure > 0.0 { max_pressure } else { 1.0 }, quantity })
    }

    /// Draws them on `body`, by default from the two sides that face the touch most; `progress` gets the share that is done and
    /// says whether to go on.
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
        if options.views.is_empty() {
            let pressed = |taxel: &usize| self.shown.iter().any(|shown| shown.pressures[*taxel] > Some(0.0));
            let normals = (0..body.taxels.len()).filter(pressed).map(|taxel| {
                let taxel = &body.taxels[taxel];
                body.links[taxel.link].body_from_link.transform_vector3(taxel.normal_in_link)
            });
            options.views = View::best(&normals.collect::<Vec<_>>());
            options.views.truncate(MAX_SIDES);
        }
        let picture = TouchPicture::new(body, fields, &options, ids)?;
        self.drawn(|moment| picture.draw(moment), progress)
    }

    /// Draws them on the chart of field `index` of `fields`; else as [`Moments::draw`].
    ///
    /// # Errors
    /// As [`super::of_chart`]; or `progress` has ended it.
    pub fn draw_chart(
        &self,
        body: &Body,
        (fields, index): (&[Field], usize),
        options: &Options,
        ids: bool,
        progress: impl FnMut(f64) -> bool,
    ) -> Result<Vec<Picture>> {
        let picture = ChartPicture::new(body, fields, index, options, ids)?;
        self.drawn(|moment| picture.draw(moment), progress)
    }

    fn drawn(
        &self,
        draw: impl Fn(&Moment<'_>) -> Result<Picture>,
        mut progress: impl FnMut(f64) -> bool,
    ) -> Result<Vec<Picture>> {
        let (factor, unit) = self.quantity.readable(self.max_pressure);
        let max_pressure = Some(self.max_pressure * factor);
        let mut pictures = Vec::with_capacity(self.shown.len());
        for (index, Shown { t_s, pressures, touches }) in self.shown.iter().enumerate() {
            let pressures: Vec<Option<f64>> = pressures.iter().map(|p| p.map(|p| p * factor)).collect();
            pictures.push(draw(&Moment { pressures: &pressures, max_pressure, unit, touches, t_s: Some(*t_s) })?);
            if !progress((index + 1) as f64 / self.shown.len() as f64) {
                return Err(Error::failed("stopped before all was drawn"));
            }
        }
        Ok(pictures)
    }
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
