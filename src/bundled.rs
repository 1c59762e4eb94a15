//! Bodies that come with the library, and a touch, so that everything can be tried without a robot.
//!
//! What each of them is, and the recipe that makes it, is in `bodies/README.md`.

pub use somatic_bodies::{BODIES, HAND, HUMANOID, MAT, MEETING, MEETING_CALIBRATION, SENSING_HAND, TOUCH, body};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::{CsvSource, Source};
    use crate::{Body, Engine, Options};

    #[test]
    fn every_bundled_body_can_feel_and_the_hand_hears_its_touch() {
        for name in BODIES {
            let body = Body::from_bytes(name, body(name).unwrap()).unwrap();
            let mut engine = Engine::new(&body, Options::default()).unwrap();
            if name == "hand" {
                let touch = CsvSource::from_reader("touch", TOUCH, None, None).unwrap();
                engine.set_channels(touch.taxels()).unwrap();
            }
        }
        assert!(body("foot").is_none());
    }
}
