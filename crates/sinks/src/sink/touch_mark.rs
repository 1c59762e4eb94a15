//! What viewers draw of a touch: an ellipsoid that lies on the skin.

use glam::{DMat3, DQuat, DVec3};

use crate::percept::Touch;

/// Diameter of a touch whose spread and area are unknown, m.
const USUAL_M: f64 = 0.01;
/// The least diameter along the skin, and the diameter across it, m: a touch of one taxel is to be seen, too.
const LEAST_M: f64 = 0.004;

/// An ellipsoid where a touch is, in the frame of the touch: x along its principal axis, z along its normal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct TouchMark {
    /// Its middle, m.
    pub(super) position: DVec3,
    /// The outward unit normal there.
    pub(super) normal: DVec3,
    /// Turns the ellipsoid's axes into those of the frame.
    pub(super) turn: DQuat,
    /// Diameters along its own x, y and z, m.
    pub(super) diameters_m: DVec3,
}

impl TouchMark {
    pub(super) fn from_touch(touch: &Touch) -> Self {
        let normal = touch.normal.normalize_or(DVec3::Z);
        let along = touch.principal_axis.and_then(|axis| axis.reject_from_normalized(normal).try_normalize());
        let along = along.unwrap_or_else(|| normal.any_orthonormal_vector());
        // A disc that is pressed evenly is four standard deviations wide.
        let by_spread = touch.spread_m.map(|spread| spread.map(|sigma_m| 4.0 * sigma_m));
        let by_area = || touch.area_m2.map(|area_m2| [2.0 * (area_m2 / std::f64::consts::PI).sqrt(); 2]);
        let [length_m, width_m] = by_spread.or_else(by_area).unwrap_or([USUAL_M; 2]).map(|m| m.max(LEAST_M));
        Self {
            position: touch.best_place(),
            normal,
            turn: DQuat::from_mat3(&DMat3::from_cols(along, normal.cross(along), normal)).normalize(),
            diameters_m: DVec3::new(length_m, width_m, LEAST_M),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Body, Engine, Options, RawValue, Scene, bundled, touch};

    #[test]
    fn an_ellipsoid_lies_on_the_skin_along_the_touch() {
        let body = Body::from_bytes("hand", bundled::HAND).unwrap();
        let scene = Scene::default().touches(touch::Options::default());
        let mut engine = Engine::new(&body, Options::default().scene(scene)).unwrap();
        let mut frame = engine.frame(0.0);
        for (index, value) in frame.values.iter_mut().enumerate() {
            *value = RawValue::new((index % 7) as f64);
        }
        engine.process_one(&frame).unwrap();
        let found = engine.percepts().touches(0).unwrap();
        let mut with_axis = 0;
        for touch in &found.touches {
            let mark = TouchMark::from_touch(touch);
            assert_eq!(mark.position, touch.position);
            let beside = touch.position + DVec3::X;
            let mut placed = touch.clone();
            placed.place = Some(beside);
            assert_eq!(TouchMark::from_touch(&placed).position, beside);
            assert!((mark.turn * DVec3::Z).distance(touch.normal) < 1e-9, "{mark:?}");
            assert!(mark.diameters_m.min_element() >= LEAST_M && mark.diameters_m.max_element() < 0.3, "{mark:?}");
            let Some((axis, [along_m, across_m])) = touch.principal_axis.zip(touch.spread_m) else { continue };
            let on_skin = axis.reject_from_normalized(touch.normal);
            assert!((mark.turn * DVec3::X).cross(on_skin).length() < 1e-9, "{mark:?} {axis}");
            assert_eq!(mark.diameters_m.x, (4.0 * along_m).max(LEAST_M));
            assert_eq!(mark.diameters_m.y, (4.0 * across_m).max(LEAST_M));
            with_axis += 1;
        }
        assert!(with_axis > 0, "{found:?}");
        // Without spread it is as wide as its area, or as usual.
        let mut bare = found.touches[0].clone();
        (bare.spread_m, bare.principal_axis, bare.area_m2) = (None, None, Some(std::f64::consts::PI * 1e-4));
        assert!((TouchMark::from_touch(&bare).diameters_m.x - 0.02).abs() < 1e-12);
        bare.area_m2 = None;
        assert_eq!(TouchMark::from_touch(&bare).diameters_m.y, USUAL_M);
    }
}
