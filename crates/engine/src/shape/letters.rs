//! The same skin with taxels of other kinds, to measure what letters cost.

use super::{FULL, Shape};
use crate::backend::BackendKind;
use crate::body::{Body, MAX_TAXEL_ID, Modality};
use crate::engine::{Engine, Options};
use crate::error::{Error, Result};
use crate::percept::Outputs;
use crate::random::Random;
use crate::scene::{Coverage, Knobs, Scene};
use crate::signal::{Channel, Frame, Letter, RawValue, Receptor};

/// Raw values of taxels that are no pressures: half of a range, so that they are temperatures and distances without a calibration.
const HALF: f64 = 512.0;

/// The kinds of taxel that `letters` read besides pressures, each at the places of all sensors.
fn more_kinds(letters: &[Receptor]) -> Vec<Modality> {
    let kinds = [(Receptor::Temperature, Modality::Temperature), (Receptor::Proximity, Modality::Proximity)];
    kinds.into_iter().filter(|(letter, _)| letters.contains(letter)).map(|(_, kind)| kind).collect()
}

impl Shape {
    /// Refuses `letters` whose taxels a body has no room for.
    pub fn check_letters(&self, letters: &[Receptor]) -> Result<()> {
        let taxels = self.sensors as u128 * (1 + more_kinds(letters).len() as u128);
        if taxels > u128::from(MAX_TAXEL_ID) + 1 {
            let most = MAX_TAXEL_ID as usize + 1;
            return Err(Error::usage(format!(
                "--sensors {} make {taxels} taxels with these letters, and a body can have {most}",
                self.sensors
            )));
        }
        Ok(())
    }

    /// [`Shape::body`] for `letters`: its sensors have three axes if shear is read, and for temperature and for proximity every sensor
    /// has one more taxel of that kind, in its place and in its fields.
    pub fn body_for(&self, letters: &[Receptor]) -> Body {
        let mut body = self.body();
        let sensors = body.taxels.clone();
        if letters.contains(&Receptor::Shear) {
            body.taxels.iter_mut().for_each(|taxel| taxel.modality = Modality::Force3);
        }
        for (place, modality) in more_kinds(letters).into_iter().enumerate() {
            let first = ((place + 1) * self.sensors) as u32;
            body.taxels.extend(sensors.iter().map(|sensor| crate::body::Taxel {
                id: first + sensor.id,
                modality,
                ..sensor.clone()
            }));
            for field in &mut body.fields {
                let own: Vec<_> =
                    field.members.range(..self.sensors as u32).map(|(&id, member)| (id, *member)).collect();
                field.members.extend(own.into_iter().map(|(id, member)| (first + id, member)));
            }
        }
        body
    }

    /// [`Shape::frames`] for `body`, which is [`Shape::body_for`] some letters: the same pressures, other values around 512, tangential
    /// ones up to half of the greatest pressure either way.
    pub fn frames_for(&self, body: &Body) -> Vec<Frame> {
        let mut random = Random::new(self.seed.rotate_left(1));
        let channels = Channel::all_of(body);
        let mut frames = self.frames();
        for frame in &mut frames {
            let more = channels[self.sensors..].iter().map(|&channel| {
                let centre = if channel < body.taxels.len() as u32 { HALF } else { 0.0 };
                RawValue::new(centre + FULL / 2.0 * (random.unit() - 0.5))
            });
            frame.values.extend(more);
        }
        frames
    }

    /// [`Shape::engine`] on `body`, which is [`Shape::body_for`] of `letters`.
    pub fn engine_for(
        &self,
        body: &Body,
        letters: &[Receptor],
        backend: BackendKind,
        outputs: Outputs,
    ) -> Result<Engine> {
        let letters = letters.iter().map(|&receptor| Letter { receptor, ..Letter::default() }).collect();
        let knobs = Knobs::default().coverage(Coverage::All);
        let scene = Scene::default().outputs(outputs).letters(letters).knobs(knobs);
        Engine::new(body, Options::default().scene(scene).backend(backend).batch(self.frames))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPE: Shape = Shape { sensors: 50, fields: 7, members: 5, wide: 50, local: false, frames: 3, seed: 9 };

    #[test]
    fn every_letter_is_there_in_every_field() {
        let letters = [Receptor::Sustained, Receptor::Shear, Receptor::Temperature, Receptor::Proximity];
        let body = SHAPE.body_for(&letters);
        let frames = SHAPE.frames_for(&body);
        assert_eq!((body.taxels.len(), frames[0].values.len()), (150, 250));
        let mut engine = SHAPE.engine_for(&body, &letters, BackendKind::Reference, Outputs::USUAL).unwrap();
        let percepts = engine.process(&frames).unwrap();
        assert_eq!(percepts.touched(0).count(), 4 * SHAPE.all_fields());
        let of = |letter: usize| percepts.touched(0).filter(move |percept| percept.letter == letter);
        assert!(of(1).all(|percept| percept.friction.is_some() && percept.torsion.is_some()));
        assert!(of(2).all(|percept| percept.temperature_gradient.is_some()));
        assert!(of(3).all(|percept| percept.covered.is_some_and(|covered| covered >= 5)));
    }

    #[test]
    fn without_other_letters_it_is_the_same_skin() {
        let body = SHAPE.body_for(&[Receptor::Sustained, Receptor::Change]);
        assert_eq!((&body.taxels, &body.fields), (&SHAPE.body().taxels, &SHAPE.body().fields));
        assert_eq!(SHAPE.frames_for(&body), SHAPE.frames());
    }
}
