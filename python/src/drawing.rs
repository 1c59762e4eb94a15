//! What `render` draws, by the command's own renderer.

use pyo3::prelude::*;
use somatic::field::FieldSet;
use somatic::internal::scene::choose_fields;
use somatic::picture::{self, Moment, Moments, Options, Picture, Times, TouchPicture, View};
use somatic::scene::Coordinates;
use somatic::{BackendKind, Engine, Error, Frame, Outputs, Scene};

use crate::arrays::array;
use crate::channels::Channels;
use crate::error::{OrRaise, interrupted};
use crate::frame_values::values;
use crate::picture::{PyPicture, Wish};
use crate::recording::PyRecording;
use crate::threads::{free, goes_on};

/// Frames that are computed until Ctrl-C is heard.
const FRAMES_BETWEEN: usize = 1 << 8;

pub(crate) fn draw(py: Python<'_>, wish: Wish<'_>) -> PyResult<PyPicture> {
    let mut raised = None;
    let times = match (wish.at_s, wish.from_s, wish.to_s) {
        (Some(t_s), ..) => Times::At(t_s),
        (None, None, None) => Times::Most,
        (None, from_s, to_s) => Times::Span {
            from_s: from_s.unwrap_or(f64::NEG_INFINITY),
            to_s: to_s.unwrap_or(f64::INFINITY),
            rate_hz: wish.rate_hz,
        },
    };
    let read = wish.recording.map(|recording| Read::from_recording(py, recording)).transpose()?;
    let drawn = free(py, || {
        let pictures = wish.pictures(read.as_ref(), times, &mut raised)?;
        let png = Picture::animation(&pictures, times.picture_s())?;
        Ok::<_, Error>((pictures, png))
    });
    let (pictures, png) = match drawn {
        Err(_) if raised.is_some() => return Err(interrupted(raised)),
        drawn => drawn.or_raise(py)?,
    };
    let (count, size) = (pictures.len(), pictures.first().map_or([0; 2], |first| first.size));
    let [width, height] = size.map(|side| side as usize);
    let opaque =
        |picture: &Picture| picture.pixels.as_chunks::<3>().0.iter().map(|&[r, g, b]| [r, g, b, u8::MAX]).collect();
    let pixels: Vec<[u8; 4]> = pictures.iter().flat_map::<Vec<[u8; 4]>, _>(opaque).collect();
    let shape = [count, height, width, 4];
    let pixels = array(py, pixels.into_flattened(), if count == 1 { &shape[1..] } else { &shape })?;
    Ok(PyPicture { size, count, pixels, png })
}

/// A recording's frames, for code without Python's lock.
struct Read {
    name: String,
    channels: Vec<u32>,
    t_s: Vec<f64>,
    values: Vec<somatic::RawValue>,
}

impl Read {
    fn from_recording(py: Python<'_>, recording: &PyRecording) -> PyResult<Self> {
        let t_s = crate::arrays::times(recording.t.bind(py))?.as_slice()?.to_vec();
        let channels = Channels::new(recording.channels.clone());
        let values = values(recording.values.bind(py), None, Some(t_s.len()), &channels)?.slice().to_vec();
        Ok(Self { name: recording.name.clone(), channels: recording.channels.clone(), t_s, values })
    }

    /// Its frames; an error ends it where Python raised something.
    fn frames<'a>(&'a self, raised: &'a mut Option<PyErr>) -> impl Iterator<Item = somatic::Result<Frame>> + 'a {
        let width = self.channels.len();
        self.t_s.iter().enumerate().map(move |(index, &t_s)| {
            if index % FRAMES_BETWEEN == 0 && !goes_on(raised) {
                return Err(Error::failed("interrupted"));
            }
            Ok(Frame { t_s, values: self.values[index * width..][..width].to_vec(), ..Frame::default() })
        })
    }
}

impl Wish<'_> {
    fn pictures(&self, read: Option<&Read>, times: Times, raised: &mut Option<PyErr>) -> somatic::Result<Vec<Picture>> {
        let body = &*self.body.inner;
        let mut views = Vec::new();
        for name in &self.views {
            match name.as_str() {
                "all" => views.extend(View::ALL),
                name => views.push(name.parse().map_err(|e: Error| e.at("views"))?),
            }
        }
        let set = FieldSet::new(body)?;
        let named = |globs: &[String]| choose_fields(&set, globs).map_err(|e| e.at(&body.name));
        let chosen = if self.fields.is_empty() { Vec::new() } else { named(&self.fields)? };
        let options =
            Options { size: self.size, views, fields: chosen, look_at: self.look_at.clone(), edges: self.edges };
        if let Some(read) = read {
            let named = self.letter.as_deref().map(picture::shown_letter).transpose().map_err(|e| e.at("letter"))?;
            let letter = named.unwrap_or_else(|| picture::usual_letter(body, &set.fields));
            let letters = picture::letters_of(body, &set.fields, letter);
            let has_pressure = letters.iter().any(|letter| letter.receptor.is_of_pressure());
            let scene = Scene::default().outputs(Outputs::TOTAL).coordinates(Coordinates::Anchor).letters(letters);
            let touches = somatic::touch::Options::default();
            let scene = if has_pressure { scene.touches(touches) } else { scene };
            let options_of_engine = somatic::Options::default().scene(scene).backend(BackendKind::Cpu).batch(1);
            let options_of_engine = match self.calibration {
                Some(calibration) => options_of_engine.calibration(calibration.inner.clone()),
                None => options_of_engine,
            };
            let mut engine = Engine::new(body, options_of_engine)?;
            engine.set_channels(&read.channels)?;
            let frames = read.frames(raised);
            let part = picture::part_of(body, &set.fields, None, self.look_at.as_deref())?;
            let moments = Moments::compute(&mut engine, body, (letter, times, &part), &read.name, frames)?;
            return moments.draw(body, &set.fields, &options, self.ids, |_| goes_on(raised));
        }
        let picture = match &self.uv {
            None if self.ids => {
                let values = vec![Some(0.0); body.taxels.len()];
                let moment = Moment::of_pressures(&values);
                TouchPicture::new(body, &set.fields, &options, true)?.draw(&moment)?
            }
            None => picture::of_body(body, &set.fields, &options)?,
            Some(name) => {
                let charted = match set.fields.iter().position(|field| field.name == *name) {
                    Some(index) => index,
                    None => named(std::slice::from_ref(name))?[0],
                };
                picture::of_chart(body, &set.fields, charted, &options)?
            }
        };
        Ok(vec![picture])
    }
}
