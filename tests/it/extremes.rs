//! The edges of the input, on every backend: an expected answer or an expected flag, and nothing that is not finite.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DQuat, DVec3};
use somatic::body::{FieldSpec, MemberSpec, Modality, Taxel};
use somatic::internal::body::Glb;
use somatic::scene::Knobs;
use somatic::{
    BackendKind, Body, Calibration, Engine, Flags, Frame, Letter, Options, Outputs, Percept, Pose, RawValue, Scene,
    touch,
};

use crate::common::{Flat, backends, frame, ways};

/// The percept of field 0 for one frame of `values`, on every backend with every knob that it has; each is also held to the
/// reference.
fn percepts(body: &Body, values: &[f64]) -> Vec<Percept> {
    let frame = frame(0.0, values);
    on_every_backend(body, &frame)
}

fn on_every_backend(body: &Body, frame: &Frame) -> Vec<Percept> {
    ways()
        .into_iter()
        .map(|way| {
            let mut engine = Engine::new(body, at_rest(way)).unwrap();
            let (percepts, agreement) = engine.process_and_compare(std::slice::from_ref(frame)).unwrap();
            assert!(agreement.holds(), "{way:?}: {agreement}");
            let percept = percepts.get(0, 0);
            assert_finite(&percept);
            percept
        })
        .collect()
}

/// Everything but motion, which a single frame has none of.
fn at_rest((backend, knobs): (BackendKind, Knobs)) -> Options {
    let moving = Outputs::DISPLACEMENT
        | Outputs::DIRECTION
        | Outputs::DISTANCE
        | Outputs::RADIAL_DISTANCE
        | Outputs::SPEED
        | Outputs::RADIAL_SPEED;
    let scene = Scene::default().outputs(Outputs::USUAL_AND_MOTION - moving).knobs(knobs);
    Options::default().backend(backend).scene(scene)
}

#[test]
fn every_output_can_be_asked_for_alone() {
    let frames = [frame(0.0, &[1.0, 2.0, 3.0, 0.5]), frame(0.1, &[3.0, 2.0, 0.0, 0.5])];
    for outputs in (Outputs::all() - Outputs::OF_OTHER_LETTERS).iter() {
        let mut seen = Vec::new();
        for backend in backends() {
            let scene = Scene::default().outputs(outputs);
            let mut engine = Engine::new(&field(&SQUARE), Options::default().backend(backend).scene(scene)).unwrap();
            let (percepts, agreement) = engine.process_and_compare(&frames).unwrap();
            assert!(agreement.holds(), "{outputs:?} on {backend:?}: {agreement}");
            // Self-contacts are of touches.
            let is_output =
                |name: &&String| !["flags", "contact"].contains(&name.as_str()) && !name.starts_with("touches");
            let mut compared = agreement.quantities.keys().filter(is_output);
            assert!(compared.all(|name| Outputs::named(name) == Some(outputs)), "{agreement}");
            seen.push(percepts.get(1, 0).flags);
        }
        assert!(seen.windows(2).all(|pair| pair[0] == pair[1]), "{outputs:?}: {seen:?}");
    }
}

fn assert_finite(percept: &Percept) {
    let scalars =
        [percept.total, percept.peak, percept.area, percept.orientation, percept.principal_axis, percept.anisotropy];
    let vectors = [percept.position, percept.normal];
    let centroid = percept.centroid.unwrap_or_default();
    let all = scalars.into_iter().flatten().chain(vectors.into_iter().flatten().flatten()).chain(centroid);
    assert!(all.into_iter().all(f64::is_finite), "{percept:?}");
    for angle in [percept.orientation, percept.principal_axis].into_iter().flatten() {
        assert!((0.0..PI).contains(&angle) && angle.is_sign_positive(), "{percept:?}");
    }
}

fn field(uv: &[[f64; 2]]) -> Body {
    Flat::new(uv).field("field", None, 0..uv.len() as u32).surface(4.0).body()
}

const SQUARE: [[f64; 2]; 4] = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];

fn near(a: Option<f64>, b: f64, within: f64) -> bool {
    a.is_some_and(|a| (a - b).abs() <= within)
}

#[test]
fn without_pressure_there_is_no_contact() {
    for values in [[0.0; 4], [-0.0; 4], [-5.0; 4]] {
        for p in percepts(&field(&SQUARE), &values) {
            assert_eq!((p.contact, p.flags), (false, Flags::NO_CONTACT));
            assert_eq!((p.total, p.peak, p.active, p.area), (Some(0.0), Some(0.0), Some(0), Some(0.0)));
            assert_eq!((p.centroid, p.position, p.orientation, p.principal_axis), (None, None, None, None));
        }
    }
}

#[test]
fn one_live_taxel_has_a_place_and_no_direction() {
    for p in percepts(&field(&SQUARE), &[0.0, 0.0, 7.0, 0.0]) {
        assert_eq!(p.flags, Flags::ONE_TAXEL);
        assert_eq!((p.centroid, p.active), (Some([0.5, 0.5]), Some(1)));
        assert_eq!((p.orientation, p.principal_axis, p.anisotropy), (None, None, None));
        assert_eq!(p.position, Some([0.5, 0.0, -0.5]));
        assert_eq!(p.normal, Some([0.0, 1.0, 0.0]));
    }
    // A field that has no more than one.
    for p in percepts(&field(&[[0.25, 0.0]]), &[3.0]) {
        assert_eq!((p.flags, p.centroid, p.total), (Flags::ONE_TAXEL, Some([0.25, 0.0]), Some(3.0)));
    }
}

#[test]
fn all_equal_is_a_tie_and_isotropic() {
    for p in percepts(&field(&SQUARE), &[3.0; 4]) {
        assert_eq!(p.flags, Flags::TIE | Flags::ISOTROPIC);
        assert_eq!((p.centroid, p.total), (Some([0.0, 0.0]), Some(12.0)));
        // The lowest two ids, 0 and 1, lie along u.
        assert_eq!((p.orientation, p.principal_axis), (Some(0.0), None));
        assert!(near(p.anisotropy, 0.0, 1e-6));
    }
}

#[test]
fn an_exact_tie_goes_to_the_lowest_ids() {
    // Three corners as far as each other: ids 1 and 2 win over 3, whatever the order they are read in.
    let uv = [[0.0, 0.0], [0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]];
    for p in percepts(&field(&uv), &[1.0, 4.0, 4.0, 4.0, 4.0]) {
        assert!(p.flags.contains(Flags::TIE));
        assert_eq!(p.orientation, Some(0.0));
    }
}

#[test]
fn all_saturated_still_answers() {
    let body = field(&[[-0.5, 0.0], [0.0, 0.0], [0.5, 0.0]]);
    let calibration = Calibration::parse("[all]\np_max = 100", &[0, 1, 2]).unwrap();
    for way in ways() {
        let options = at_rest(way).calibration(calibration.clone());
        let mut engine = Engine::new(&body, options).unwrap();
        let p = engine.process(&[frame(0.0, &[1023.0; 3])]).unwrap().get(0, 0);
        assert_eq!(p.flags, Flags::SATURATED);
        assert_eq!((p.orientation, p.total), (Some(0.0), Some(3069.0)));
        let at_the_edge = engine.process(&[frame(0.0, &[100.0; 3])]).unwrap().get(0, 0);
        assert_eq!(at_the_edge.flags, Flags::empty());
    }
}

#[test]
fn collinear_taxels_have_their_line() {
    for degrees in [0.0, 1e-4, 30.0, 89.9999, 90.0, 90.0001, 135.0, 179.9999_f64] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let uv: Vec<[f64; 2]> = [-1.0, -0.4, 0.1, 0.7].iter().map(|r| [r * cos, r * sin]).collect();
        for p in percepts(&field(&uv), &[5.0, 9.0, 2.0, 6.0]) {
            let apart = |angle: Option<f64>| {
                let d = (angle.unwrap() - degrees.to_radians()).abs();
                d.min(PI - d)
            };
            // Positions are stored in single precision.
            assert!(apart(p.orientation) < 1e-5 && apart(p.principal_axis) < 1e-5, "{degrees} {p:?}");
            assert!(near(p.anisotropy, 1.0, 1e-5));
        }
    }
}

#[test]
fn vertical_is_not_a_special_case() {
    for p in percepts(&field(&[[0.25, -0.5], [0.25, 0.5]]), &[2.0, 2.0]) {
        assert!(near(p.orientation, FRAC_PI_2, 1e-6) && near(p.principal_axis, FRAC_PI_2, 1e-6), "{p:?}");
    }
}

#[test]
fn the_seam_is_crossed_without_reaching_pi() {
    for v in [0.0, -0.0, 1e-8, -1e-8, 1e-30, -1e-30, 3e-7, -3e-7] {
        for [a, b] in [[[-1.0, -v], [1.0, v]], [[1.0, v], [-1.0, -v]]] {
            for p in percepts(&field(&[a, b]), &[2.0, 2.0]) {
                let angle = p.orientation.unwrap();
                assert!(angle.min(PI - angle) < 1e-6, "{v} {angle}");
            }
        }
    }
}

#[test]
fn coincident_taxels_have_no_line() {
    for p in percepts(&field(&[[0.5, 0.25]; 3]), &[1.0, 2.0, 3.0]) {
        assert_eq!(p.flags, Flags::COINCIDENT);
        assert_eq!((p.centroid, p.active), (Some([0.5, 0.25]), Some(3)));
        assert_eq!((p.orientation, p.principal_axis, p.anisotropy), (None, None, None));
    }
    // Two on one point and one elsewhere: the two farthest points may coincide while the spread has an axis.
    for p in percepts(&field(&[[0.5, 0.0], [0.5, 0.0], [-0.5, 0.0]]), &[1.0, 1.0, 2.0]) {
        assert!(near(p.principal_axis, 0.0, 1e-6), "{p:?}");
    }
}

#[test]
fn what_is_not_finite_is_left_out_and_flagged() {
    let body = field(&SQUARE);
    for bad in [f64::NAN, -f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, 1.2e18, -1.2e18] {
        for p in percepts(&body, &[2.0, bad, 0.0, 2.0]) {
            assert!(p.flags.contains(Flags::FAULTY_INPUT), "{bad}");
            assert_eq!((p.total, p.active, p.centroid), (Some(4.0), Some(2), Some([-0.5, 0.0])), "{bad}");
        }
        for p in percepts(&body, &[bad; 4]) {
            assert_eq!(p.flags, Flags::FAULTY_INPUT | Flags::NO_CONTACT, "{bad}");
            // Nothing was measured: no total, rather than a total of nothing.
            assert_eq!((p.total, p.peak, p.active, p.area), (None, None, None, None), "{bad}");
        }
    }
    // Every quiet and signalling NaN there is a bit for, as a device or a driver may deliver it.
    for bits in (0..23).map(|bit| 0x7F80_0001_u32 | 1 << bit).chain([0xFF80_0001, 0xFFC0_0000]) {
        let mut frame = frame(0.0, &[2.0, 0.0, 0.0, 2.0]);
        frame.values[1] = RawValue::new(f64::from(f32::from_bits(bits)));
        for p in on_every_backend(&body, &frame) {
            assert_eq!((p.total, p.flags), (Some(4.0), Flags::FAULTY_INPUT), "{bits:08x}");
        }
    }
}

#[test]
fn what_is_too_small_counts_as_nothing_and_is_reported() {
    for tiny in [1e-300, 1e-45, 1e-40, 1e-38, 8.6e-19, -1e-20] {
        for p in percepts(&field(&SQUARE), &[2.0, tiny, 0.0, 2.0]) {
            assert_eq!((p.total, p.active, p.flags), (Some(4.0), Some(2), Flags::FAULTY_INPUT), "{tiny}");
        }
    }
}

#[test]
fn pressures_answer_alike_over_all_their_range() {
    // 2⁻⁶⁰ to 2⁶⁰, in powers of two: the same answers to the bit, the total scaled.
    let body = field(&[[-0.5, -0.3], [0.4, -0.5], [0.5, 0.5], [-0.2, 0.1]]);
    let values = [3.0, 1.0, 2.0, 1.5];
    let plain = percepts(&body, &values);
    for exponent in [-60, -30, -3, 17, 58] {
        let scale = 2.0_f64.powi(exponent);
        for (p, plain) in percepts(&body, &values.map(|v| v * scale)).iter().zip(&plain) {
            let mut expected = *plain;
            (expected.total, expected.peak) = (plain.total.map(|t| t * scale), plain.peak.map(|t| t * scale));
            assert_eq!(*p, expected, "2^{exponent}");
        }
    }
}

#[test]
fn a_faint_neighbour_of_a_huge_value_does_no_harm() {
    for p in percepts(&field(&SQUARE), &[1.0e18, 1.0e-18, 0.0, 1.0]) {
        assert!(near(p.total, 1.0e18, 1e12) && p.active == Some(3));
        let [u, v] = p.centroid.unwrap();
        assert!((u + 0.5).abs() < 1e-6 && (v + 0.5).abs() < 1e-6);
    }
}

#[test]
fn a_missing_value_is_left_out_and_flagged() {
    let body = field(&SQUARE);
    let mut some = frame(0.0, &[2.0, 9.0, 0.0, 2.0]);
    some.values[1] = RawValue::MISSING;
    for p in on_every_backend(&body, &some) {
        assert_eq!((p.total, p.flags & Flags::INCOMPLETE), (Some(4.0), Flags::INCOMPLETE));
        assert!(!p.flags.contains(Flags::FAULTY_INPUT));
    }
    for p in on_every_backend(&body, &Frame::missing(0.0, 4)) {
        assert_eq!((p.total, p.flags), (None, Flags::INCOMPLETE | Flags::NO_CONTACT));
    }
}

#[test]
fn a_raw_value_that_is_not_a_reading_is_missing() {
    let body = field(&SQUARE);
    let calibration = Calibration::parse("[all]\nbaseline = 1\nmissing = [30000]", &[0, 1, 2, 3]).unwrap();
    for (way, code, is_missing) in ways().into_iter().flat_map(|way| [(way, 30_000.0, true), (way, 30_001.0, false)]) {
        let mut engine = Engine::new(&body, at_rest(way).calibration(Some(calibration.clone()))).unwrap();
        let frames = [frame(0.0, &[3.0, code, 1.0, 3.0]), Frame::missing(0.1, 4)];
        let (percepts, agreement) = engine.process_and_compare(&frames).unwrap();
        assert!(agreement.holds(), "{way:?}: {agreement}");
        let p = percepts.get(0, 0);
        assert_eq!((p.total == Some(4.0), p.flags.contains(Flags::INCOMPLETE)), (is_missing, is_missing), "{way:?}");
        assert!(!p.flags.contains(Flags::FAULTY_INPUT));
    }
}

#[test]
fn the_extreme_weights_hold() {
    let mut glb = Glb::new();
    let link = glb.node("skin", None, DVec3::ZERO);
    let taxel = |id: u32, u: f64| Taxel {
        id,
        link: 0,
        position_in_link: DVec3::new(u, 0.0, 0.0),
        normal_in_link: DVec3::Y,
        area: 0.0,
        modality: Modality::Pressure,
        tangent_in_link: None,
    };
    glb.taxels("taxels", Some(link), &[taxel(0, -1.0), taxel(1, 1.0)], None);
    let weights = [1.0 / 1_048_576.0, 1_048_576.0];
    let members = (0..2).map(|id| (id, MemberSpec { weight: weights[id as usize], uv: None })).collect();
    glb.field(&FieldSpec { name: "field".into(), members, ..FieldSpec::default() }, Some(link), DVec3::ZERO);
    let body = Body::from_bytes("weights", &glb.to_bytes().unwrap()).unwrap();
    for values in [[1.15e18, 1.15e18], [1e-18, 1e-18], [1.15e18, 1e-18], [1e-18, 1.15e18]] {
        for p in percepts(&body, &values) {
            assert!(p.contact && p.area.is_none(), "{p:?}");
        }
    }
}

#[test]
fn a_body_in_millimetres_or_kilometres_keeps_its_accuracy() {
    for scale in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
        let uv: Vec<[f64; 2]> = [[-0.5, 0.0], [0.25, 0.5], [0.5, -0.25]].map(|[u, v]| [u * scale, v * scale]).into();
        for p in percepts(&field(&uv), &[1.0, 2.0, 3.0]) {
            let [u, v] = p.centroid.unwrap();
            assert!((u / scale - 0.25).abs() < 1e-6 && (v / scale - 0.25 / 6.0).abs() < 1e-6, "{scale}");
        }
    }
}

#[test]
fn ten_kilometres_from_the_origin_nothing_is_lost() {
    // Places that single precision holds exactly at this distance; without local charts their mean would be off by up
    // to a millimetre.
    let step = 1.0 / 128.0;
    let uv: Vec<[f64; 2]> = (0..25).map(|i| [f64::from(i % 5) * step, f64::from(i / 5) * step]).collect();
    let values: Vec<f64> = (0..25).map(|i| f64::from((i * 7) % 11)).collect();
    let far = DVec3::new(8192.0, 4096.0, -8192.0);
    let spec = |origin| {
        let flat = Flat::at(&uv, origin);
        let mut flat = flat;
        let members = (0..25).map(|id| (id, MemberSpec::default())).collect();
        let field = FieldSpec { name: "field".into(), members, ..FieldSpec::default() };
        flat.glb.field(&field, Some(0), DVec3::ZERO);
        flat.body()
    };
    let here = percepts(&spec(DVec3::ZERO), &values);
    for (p, here) in percepts(&spec(far), &values).iter().zip(&here) {
        let shifted = DVec3::from_array(p.position.unwrap()) - far;
        assert!(shifted.distance(DVec3::from_array(here.position.unwrap())) < 1e-8, "{p:?} {here:?}");
        assert!(near(p.orientation, here.orientation.unwrap(), 1e-5));
        // Second moments about the body's origin would subtract 10⁸ m² from 10⁸ m²; f32 keeps some 8 m² of that.
        assert!(
            near(p.principal_axis, here.principal_axis.unwrap(), 1e-5)
                && near(p.anisotropy, here.anisotropy.unwrap(), 1e-5)
        );
    }
}

#[test]
fn a_pose_puts_the_answer_in_the_world() {
    let body = field(&SQUARE);
    let mut posed = frame(0.0, &[0.0, 0.0, 7.0, 0.0]);
    let pose = Pose { translation: DVec3::new(1e4, 2e4, -3e4), rotation: DQuat::from_rotation_z(FRAC_PI_2) };
    posed.pose.push(("skin".into(), pose));
    for p in on_every_backend(&body, &posed) {
        let right = DVec3::new(1e4, 2e4 + 0.5, -3e4 - 0.5);
        assert!(p.in_world && DVec3::from_array(p.position.unwrap()).distance(right) < 1e-9);
        assert!(DVec3::from_array(p.normal.unwrap()).distance(DVec3::NEG_X) < 1e-12);
        // The chart is the field's own and does not turn with the robot.
        assert_eq!(p.centroid, Some([0.5, 0.5]));
    }
    // Who asks for the anchor's frame gets it, whatever poses there are.
    for way in ways() {
        let mut options = at_rest(way);
        options.scene.coordinates = somatic::scene::Coordinates::Anchor;
        let p = Engine::new(&body, options).unwrap().process(std::slice::from_ref(&posed)).unwrap().get(0, 0);
        assert_eq!(
            (p.in_world, p.position, p.normal),
            (false, Some([0.5, 0.0, -0.5]), Some([0.0, 1.0, 0.0])),
            "{way:?}"
        );
    }
}

#[test]
fn a_field_around_a_limb_has_no_chart_and_says_where_it_is() {
    let mut glb = Glb::new();
    let link = glb.node("forearm", None, DVec3::ZERO);
    let taxels: Vec<Taxel> = (0..12)
        .map(|id| {
            let (sin, cos) = (f64::from(id) / 12.0 * 2.0 * PI).sin_cos();
            Taxel {
                id: id as u32,
                link: 0,
                position_in_link: DVec3::new(0.04 * cos, 0.1, 0.04 * sin),
                normal_in_link: DVec3::new(cos, 0.0, sin),
                area: 1e-4,
                modality: Modality::Pressure,
                tangent_in_link: None,
            }
        })
        .collect();
    glb.taxels("taxels", Some(link), &taxels, None);
    let members = (0..12).map(|id| (id, MemberSpec::default())).collect();
    glb.field(&FieldSpec { name: "forearm".into(), members, ..FieldSpec::default() }, Some(link), DVec3::ZERO);
    let body = Body::from_bytes("forearm", &glb.to_bytes().unwrap()).unwrap();
    let mut values = [0.0; 12];
    (values[0], values[3]) = (3.0, 1.0);
    for p in percepts(&body, &values) {
        assert_eq!(p.flags, Flags::NO_CHART);
        assert_eq!((p.centroid, p.normal, p.orientation, p.principal_axis), (None, None, None, None));
        assert_eq!((p.total, p.active), (Some(4.0), Some(2)));
        let mean = DVec3::new(0.03, 0.1, 0.01);
        assert!(DVec3::from_array(p.position.unwrap()).distance(mean) < 1e-8, "{p:?}");
    }
    for p in percepts(&body, &[0.0; 12]) {
        assert_eq!((p.flags, p.position), (Flags::NO_CHART | Flags::NO_CONTACT, None));
    }
}

#[test]
fn a_field_of_a_million_taxels_answers() {
    let side = 1000_u32;
    let uv: Vec<[f64; 2]> =
        (0..side * side).map(|i| [f64::from(i % side) * 1e-3, f64::from(i / side) * 1e-3]).collect();
    let body = Flat::new(&uv).field("field", None, 0..side * side).body();
    let values: Vec<f64> = (0..side * side).map(|i| f64::from((i % 4096 * 7919) % 1024)).collect();
    let frame = frame(0.0, &values);
    for way in ways() {
        // Without position, which would lay a grid over the surface.
        let mut options = at_rest(way);
        options.scene.outputs -= Outputs::POSITION | Outputs::NORMAL;
        let mut engine = Engine::new(&body, options).unwrap();
        let (percepts, agreement) = engine.process_and_compare(std::slice::from_ref(&frame)).unwrap();
        assert!(agreement.holds(), "{way:?}: {agreement}");
        assert_eq!(percepts.get(0, 0).active, Some(values.iter().filter(|&&v| v > 0.0).count() as u32));
    }
}

#[test]
fn a_line_between_faint_points_beside_a_strong_one_is_the_references() {
    let uv: Vec<[f64; 2]> = (0..16).map(|i| [0.013 * f64::from(i % 4) + 0.001, 0.011 * f64::from(i / 4)]).collect();
    let body = Flat::new(&uv).field("field", None, 0..16).surface(1.0).body();
    let outputs = Outputs::ORIENTATION | Outputs::TOTAL;
    let run = |backend: BackendKind, frames: &[Frame]| {
        let options = Options::default().backend(backend).scene(Scene::default().outputs(outputs)).batch(64);
        let mut engine = Engine::new(&body, options).unwrap();
        engine.process(frames).unwrap().clone()
    };
    let mut random = 7_u32;
    let mut next = move || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        random >> 8
    };
    // One taxel at 10⁵, some at 10⁻⁶ or a little more.
    let mut frame_at = |index: u32| {
        let strong = next() % 16;
        let value = |taxel: u32, chance: u32| match chance % 3 {
            _ if taxel == strong => 1e5,
            0 => 1e-6 * (1.0 + f64::from(chance % 1000) / 100.0),
            _ => 0.0,
        };
        let values: Vec<f64> = (0..16).map(|taxel| value(taxel, next())).collect();
        frame(0.01 * f64::from(index), &values)
    };
    let frames: Vec<Frame> = (0..200).map(&mut frame_at).collect();
    let right = run(BackendKind::Reference, &frames);
    for backend in backends() {
        let found = run(backend, &frames);
        let mut compared = 0;
        for frame in 0..frames.len() {
            let (found, right) = (found.get(frame, 0), right.get(frame, 0));
            assert_eq!(
                (found.flags, found.orientation.is_some()),
                (right.flags, right.orientation.is_some()),
                "{frame}"
            );
            if let (Some(found), Some(right)) = (found.orientation, right.orientation) {
                let apart = (found - right).abs().min(PI - (found - right).abs());
                assert!(apart < 1e-6, "{backend:?}, frame {frame}: {found}, not {right}");
                compared += 1;
            }
        }
        assert!(compared > 150, "{compared}");
    }
}

#[test]
fn a_taxel_that_measures_something_else_is_left_out_and_named() {
    let mut body = Flat::new(&SQUARE).field("field", None, 0..4).field("warm", None, 2..4).surface(1.0).body();
    let plain = body.clone();
    body.taxels[2].modality = Modality::Temperature;
    body.taxels[3].modality = Modality::Proximity;
    // What it measures is neither in sums nor in flags, not even where it is faulty.
    let mut reported = frame(0.0, &[3.0, 1.0, 37.0, 0.2]);
    reported.values[3] = RawValue::FAULTY;
    let untold = frame(0.0, &[3.0, 1.0, 0.0, 0.0]);
    for backend in backends() {
        let scene = Scene::default().touches(touch::Options::default()).letters(vec![Letter::default()]);
        let engine = |body: &Body| Engine::new(body, Options::default().backend(backend).scene(scene.clone())).unwrap();
        let (mut mixed, mut pressures) = (engine(&body), engine(&plain));
        assert_eq!(mixed.plan().fields().map(|field| field.name.to_owned()).collect::<Vec<_>>(), ["field"]);
        let (percepts, agreement) = mixed.process_and_compare(std::slice::from_ref(&reported)).unwrap();
        assert!(agreement.holds(), "{agreement}");
        let (found, right) = (percepts.get(0, 0), pressures.process_one(&untold).unwrap().get(0, 0));
        let of = |p: &Percept| (p.total, p.peak, p.active, p.area, p.centroid, p.orientation, p.flags);
        assert_eq!((of(&found), found.total), (of(&right), Some(4.0)));
        let remark = mixed.remarks();
        assert_eq!(remark.len(), 1);
        assert!(remark[0].contains("taxel 3 measures proximity, taxel 2 measures temperature"), "{remark:?}");
        assert!(remark[0].contains("field `warm` has no other"), "{remark:?}");
        assert!(pressures.remarks().is_empty());
    }
    body.taxels.iter_mut().for_each(|taxel| taxel.modality = Modality::Temperature);
    let scene = Scene::default().letters(vec![Letter::default()]);
    let why = Engine::new(&body, Options::default().scene(scene)).err().unwrap().to_string();
    assert!(
        why.contains("no field has a taxel that measures pressure") && why.contains("the taxels have temperature"),
        "{why}"
    );
}

#[test]
fn nothing_is_kept_over_a_restart_of_time() {
    let body = field(&SQUARE);
    let calibration = Calibration::parse("[contact]\non = 5\noff = 1\n", &[0, 1, 2, 3]).unwrap();
    // Over the threshold, then under it but over that at which a touch ends.
    let (hard, soft) = ([9.0, 0.0, 0.0, 0.0], [3.0, 0.0, 0.0, 0.0]);
    let at = |times: &[(f64, [f64; 4])]| times.iter().map(|(t_s, values)| frame(*t_s, values)).collect::<Vec<_>>();
    for backend in backends() {
        for back_or_on in [-5.0, 20.0] {
            let frames = at(&[
                (0.0, hard),
                (0.1, soft),
                (back_or_on, soft),
                (back_or_on + 0.1, hard),
                (back_or_on + 0.2, soft),
                (back_or_on + 0.2, hard),
                (3.0 * back_or_on, hard),
            ]);
            let asked = touch::Options { on: 5.0, off: 1.0, ..touch::Options::default() };
            let scene = Scene::default().outputs(Outputs::USUAL_AND_MOTION).touches(asked);
            let options = Options::default().backend(backend).scene(scene).calibration(calibration.clone());
            let mut engine = Engine::new(&body, options.clone()).unwrap();
            let (percepts, agreement) = engine.process_and_compare(&frames).unwrap();
            assert!(agreement.holds(), "{agreement}");
            let id = |index: usize| percepts.touches(index).unwrap().touches.first().map(|touch| touch.id);
            let ids: Vec<Option<u64>> = (0..7).map(id).collect();
            // A stamp that repeats is no restart; identities are never used again.
            assert_eq!(ids, [Some(1), Some(1), None, Some(2), Some(2), Some(2), Some(3)], "{backend:?}, {back_or_on}");
            let flags = |index: usize| percepts.get(index, 0).flags & (Flags::BAD_DT | Flags::NO_PREVIOUS);
            let expected = [Flags::NO_PREVIOUS, Flags::empty(), Flags::empty(), Flags::NO_PREVIOUS, Flags::empty()];
            assert_eq!((0..5).map(flags).collect::<Vec<_>>(), expected);
            assert_eq!([flags(5), flags(6)], [Flags::BAD_DT; 2]);
            // The same however it is cut.
            let whole = percepts.clone();
            let mut alone = Engine::new(&body, options).unwrap();
            for (index, frame) in frames.iter().enumerate() {
                let one = alone.process_one(frame).unwrap();
                assert_eq!((one.get(0, 0), one.touches(0)), (whole.get(index, 0), whole.touches(index)));
            }
        }
    }
}

#[test]
fn drift_that_no_taxel_can_tell_is_named_at_the_start() {
    let calibration = |keys: &str| Calibration::parse(keys, &[0, 1, 2, 3, 4, 5]).unwrap();
    let uv = [[0.0, 0.0], [0.1, 0.0], [0.0, 0.1], [0.1, 0.1], [0.0, 0.2], [0.1, 0.2]];
    let remarks = |fields: &[std::ops::Range<u32>], keys: &str| {
        let flat = fields.iter().enumerate().fold(Flat::new(&uv).surface(1.0), |flat, (index, ids)| {
            flat.field(&format!("f{index}"), None, ids.clone())
        });
        let options = Options::default().backend(BackendKind::Cpu).calibration(calibration(keys));
        Engine::new(&flat.body(), options).unwrap().remarks()
    };
    let drift = "[drift]\ntime_constant_s = 2\n";
    let reported = remarks(std::slice::from_ref(&(0..6)), drift);
    assert!(reported.len() == 1 && reported[0].contains("no taxel can tell the drift"), "{reported:?}");
    // Three others can, two cannot.
    assert!(
        remarks(&[0..2, 2..5], drift).is_empty()
            && remarks(std::slice::from_ref(&(0..6)), "[drift]\nstuck_s = 4\n").is_empty()
    );
    assert!(remarks(&[0..2, 2..5], &format!("{drift}[taxel.4]\nmask = true\n")).len() == 1);
}
