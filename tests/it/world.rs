//! Touches on links that move: where they are in the world, or in a link that stands for it, and how fast.

use glam::{DQuat, DVec3};
use somatic::{Engine, Options, Outputs, Pose, Scene};

use crate::common::{Flat, backends, frame};

/// (u, v) is (x, −z) of the link.
const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]];
const DT_S: f64 = 0.01;

/// A turn about the world's z in each frame, far from its origin, m and rad.
fn pose(index: u32) -> Pose {
    let rotation = DQuat::from_rotation_z(0.2 * f64::from(index));
    Pose { translation: DVec3::new(3.0, -2.0, 5.0), rotation }
}

#[test]
fn a_touch_that_rests_on_a_turning_link_moves_in_the_world_alone() {
    let body = Flat::new(&SQUARE).field("field", None, 0..4).surface(4.0).body();
    let frames: Vec<_> = (0..5)
        .map(|index| {
            let mut frame = frame(DT_S * f64::from(index), &[0.0, 7.0, 3.0, 0.0]);
            frame.pose.push(("skin".into(), pose(index)));
            frame
        })
        .collect();
    let outputs = Outputs::POSITION | Outputs::SPEED | Outputs::SPEED_IN_WORLD;
    for backend in backends() {
        for link in [None, Some("skin")] {
            let scene = Scene::default().outputs(outputs).in_link(link);
            let mut engine = Engine::new(&body, Options::default().backend(backend).scene(scene)).unwrap();
            let (percepts, agreement) = engine.process_and_compare(&frames).unwrap();
            assert!(agreement.holds() && agreement.quantities["speed_in_world"].compared == 4, "{agreement}");
            // On a circle around the link's own z, at 0.1 m; of a chord of 0.2 rad.
            let expected = if link.is_some() { 0.0 } else { 2.0 * 0.1 * 0.1_f64.sin() / DT_S };
            for index in 0..5 {
                let percept = percepts.get(index as usize, 0);
                assert!(percept.in_world);
                let in_link = DVec3::new(0.1, 0.0, -0.03);
                let posed = pose(index);
                let right = if link.is_some() { in_link } else { posed.translation + posed.rotation * in_link };
                let off = DVec3::from_array(percept.position.unwrap()).distance(right);
                assert!(off < 1e-8, "{backend:?}, {link:?}: {off}");
                let Some(speed) = percept.speed_in_world else {
                    assert_eq!(index, 0);
                    continue;
                };
                assert!((speed - expected).abs() < 1e-9 / DT_S, "{backend:?}, {link:?}: {speed}, not {expected}");
                assert_eq!(percept.speed, Some(0.0));
            }
        }
    }
}
