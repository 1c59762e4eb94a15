//! Shear and temperature of touches: weighed as places are, with what taxels of one axis press, and warm as what lies under them.

use std::f64::consts::FRAC_PI_2;

use glam::{DQuat, DVec2, DVec3, Mat4};
use somatic::body::{Modality, Taxel};
use somatic::internal::body::{Glb, MeshData, Skinning};
use somatic::percept::{Touch as Felt, TouchFlags};
use somatic::signal::Pose;
use somatic::{BackendKind, Body, Calibration, Engine, Flags, Frame, Options, RawValue, Scene, touch};

use crate::common::backends;
use crate::senses::{PITCH, TOUCH, Touch, WARM, engine, grid, skin};

/// Taxels of these kinds and areas, m², in a row 5 mm apart along x, which is the first tangent; ids from 0.
fn row(kinds: &[(Modality, f64)]) -> Body {
    let mut glb = Glb::new();
    let link = glb.node("row", None, DVec3::ZERO);
    let taxel = |(id, &(modality, area)): (u32, &(Modality, f64))| Taxel {
        id,
        link: 0,
        position_in_link: DVec3::new(PITCH * f64::from(id), 0.0, 0.0),
        normal_in_link: DVec3::Y,
        area,
        modality,
        tangent_in_link: (modality == Modality::Force3).then_some(DVec3::X),
    };
    let taxels: Vec<Taxel> = (0..).zip(kinds).map(taxel).collect();
    glb.taxels("taxels", Some(link), &taxels, None);
    glb.field(
        &somatic::body::FieldSpec {
            name: "row".into(),
            parent: None,
            members: taxels.iter().map(|taxel| (taxel.id, Default::default())).collect(),
            chart: None,
        },
        Some(link),
        DVec3::ZERO,
    );
    Body::from_bytes("row", &glb.to_bytes().unwrap()).unwrap()
}

fn scene() -> Scene {
    Scene::default().touches(touch::Options::default())
}

/// The engine of `body`, and a frame with these values.
fn calibrated(body: &Body, kind: BackendKind, calibration: &str, values: &[(&str, f64)]) -> (Engine, Frame) {
    let ids: Vec<(u32, Modality)> = body.taxels.iter().map(|taxel| (taxel.id, taxel.modality)).collect();
    let calibration = Calibration::parse_for(calibration, &ids).unwrap();
    let options = Options::default().scene(scene()).calibration(Some(calibration)).backend(kind);
    let engine = Engine::new(body, options).unwrap();
    let mut frame = engine.frame(0.0);
    frame.values.fill(RawValue::new(0.0));
    for &(name, value) in values {
        frame.values[engine.index_of(name).unwrap()] = RawValue::new(value);
    }
    (engine, frame)
}

/// The one touch of `frame`.
fn felt(engine: &mut Engine, frame: &Frame) -> Felt {
    let found = engine.process_one(frame).unwrap().touches(0).unwrap();
    let [touch] = &found.touches[..] else { panic!("{} touches", found.touches.len()) };
    touch.clone()
}

#[test]
fn where_p_is_a_pressure_large_cells_pull_more() {
    let body = row(&[(Modality::Force3, 1e-4), (Modality::Force3, 4e-4)]);
    for kind in backends() {
        let values = [("0", 100.0), ("0.u", 10.0), ("1", 100.0), ("1.u", 60.0)];
        let (mut engine, frame) = calibrated(&body, kind, "[all]\nunit = \"Pa\"", &values);
        let touch = felt(&mut engine, &frame);
        // Forces of 1 and 24 mN along the skin, of 10 and 40 mN into it.
        let force = touch.force_vector_newton.unwrap();
        assert!((force - DVec3::new(25e-3, -50e-3, 0.0)).length() < 1e-7, "{kind:?}: {force}");
        assert!((touch.friction.unwrap() - 0.5).abs() < 1e-6, "{kind:?}: {:?}", touch.friction);
        let right = touch.friction.unwrap() * touch.total;
        assert!((touch.shear.unwrap() - DVec3::X * right).length() < 1e-4, "{:?}", touch.shear);
        assert!((DVec2::from_array(touch.shear_in_chart.unwrap()) - DVec2::X * right).length() < 1e-4);
    }
}

#[test]
fn taxels_of_one_axis_press_in_the_force_of_a_touch() {
    use Modality::{Force3, Pressure};
    let body = row(&[(Force3, 1e-4), (Force3, 1e-4), (Pressure, 1e-4), (Pressure, 1e-4)]);
    let values = [("0", 1.0), ("0.u", 0.3), ("1", 1.0), ("1.u", 0.3), ("2", 1.0), ("3", 1.0)];
    for kind in backends() {
        let (mut engine, frame) = calibrated(&body, kind, "[all]\nunit = \"N\"", &values);
        let touch = felt(&mut engine, &frame);
        let force = touch.force_vector_newton.unwrap();
        assert!((force - DVec3::new(0.6, -4.0, 0.0)).length() < 1e-6, "{kind:?}: {force}");
        assert_eq!(touch.force_newton, Some(4.0));
        // How the others pull is not known: friction is of those that are.
        assert!((touch.friction.unwrap() - 0.3).abs() < 1e-6);
    }
}

#[test]
fn values_as_at_rest_have_no_direction_however_large_they_are() {
    let body = skin(1);
    let calibration = "[all]\nunit = \"N\"\n[shear]\nbaseline = [512.1, -300.7]";
    let pressed = |side: [f64; 2]| {
        let names: Vec<[String; 3]> =
            (0..25).map(|id| [format!("{id}"), format!("{id}.u"), format!("{id}.v")]).collect();
        let values: Vec<(&str, f64)> = names
            .iter()
            .flat_map(|[n, u, v]| [(n.as_str(), 1.0), (u.as_str(), side[0]), (v.as_str(), side[1])])
            .collect();
        calibrated(&body, BackendKind::Cpu, calibration, &values)
    };
    let (mut engine, frame) = pressed([512.1, -300.7]);
    let touch = felt(&mut engine, &frame);
    assert_eq!((touch.shear_direction_rad, touch.flags.contains(TouchFlags::STILL)), (None, true));
    let field = engine.process_one(&frame).unwrap().frame(0).find(|percept| percept.friction.is_some()).unwrap();
    assert_eq!((field.shear_direction, field.flags.contains(Flags::STILL)), (None, true));
    let (mut engine, frame) = pressed([512.2, -300.7]);
    // A tenth of what presses pulls along t, which is the chart's +v.
    let touch = felt(&mut engine, &frame);
    assert!((touch.shear_direction_rad.unwrap() - FRAC_PI_2).abs() < 1e-3 && !touch.flags.contains(TouchFlags::STILL));
}

/// The ids of the taxels of temperature under a touch, and what each has there.
fn under(frame: &Frame, engine: &Engine) -> Vec<(u32, f64)> {
    let number = |id: u32| frame.values[engine.index_of(&id.to_string()).unwrap()].number().unwrap();
    grid().filter(|&(id, _)| number(id) > 0.0).map(|(id, _)| (WARM + id, number(WARM + id))).collect()
}

#[test]
fn a_touch_is_warm_as_what_lies_under_it() {
    let body = skin(3);
    for kind in backends() {
        let mut engine = engine(&body, kind, scene());
        for index in 0..20 {
            let t_s = 0.05 * f64::from(index);
            let touch = Touch { celsius: 25.0 + 6.0 * t_s, ..TOUCH };
            let frame = touch.frame(&engine, t_s);
            let under = under(&frame, &engine);
            let felt = felt(&mut engine, &frame);
            let mean = under.iter().map(|(_, celsius)| celsius).sum::<f64>() / under.len() as f64;
            assert!((felt.temperature_celsius.unwrap() - mean).abs() < 1e-9);
            let warmest = under.iter().copied().reduce(|a, b| if b.1 > a.1 { b } else { a }).unwrap();
            let coldest = under.iter().copied().reduce(|a, b| if b.1 < a.1 { b } else { a }).unwrap();
            assert_eq!((felt.warmest_taxel, felt.warmest_celsius), (Some(warmest.0), Some(warmest.1)), "{kind:?}");
            assert_eq!((felt.coldest_taxel, felt.coldest_celsius), (Some(coldest.0), Some(coldest.1)), "{kind:?}");
            // u of its chart is the link's x, v its −z.
            let gradient = DVec2::from_array(felt.temperature_gradient_kelvin_per_m.unwrap());
            assert!((gradient - DVec2::new(300.0, -100.0)).length() < 1e-2, "{gradient}");
            // Half of the window is 0.25 s.
            match felt.temperature_rate_kelvin_per_s {
                Some(rate) => assert!(index >= 5 && (rate - 6.0).abs() < 1e-3, "{index}: {rate}"),
                None => assert!(index < 5, "{index}"),
            }
            assert_eq!(felt.flags.contains(TouchFlags::NO_PREVIOUS), index < 5);
        }
        // Time begins anew.
        let again = TOUCH.frame(&engine, 0.0);
        assert!(felt(&mut engine, &again).temperature_rate_kelvin_per_s.is_none());
    }
}

#[test]
fn a_touch_that_moves_over_what_is_warm_does_not_warm() {
    let body = skin(3);
    let mut engine = engine(&body, BackendKind::Cpu, scene());
    let mut rates = Vec::new();
    for index in 0..40 {
        let t_s = 0.02 * f64::from(index);
        let at = DVec2::new(PITCH * (2.0 * t_s - 0.8), 0.0);
        let frame = Touch { at, ..TOUCH }.frame(&engine, t_s);
        rates.extend(felt(&mut engine, &frame).temperature_rate_kelvin_per_s);
    }
    // 300 K/m under 10 mm/s would be 3 K/s.
    assert!(rates.len() > 20 && rates.iter().all(|rate| rate.abs() < 1e-9), "{rates:?}");
}

#[test]
fn a_touch_says_what_is_lost_of_its_warmth() {
    let body = skin(3);
    let mut engine = engine(&body, BackendKind::Cpu, scene());
    let mut frame = TOUCH.frame(&engine, 0.0);
    let lose = |frame: &mut Frame, engine: &Engine, ids: &mut dyn Iterator<Item = u32>| {
        for id in ids {
            frame.values[engine.index_of(&id.to_string()).unwrap()] = RawValue::MISSING;
        }
    };
    // Two are left, in a line.
    lose(&mut frame, &engine, &mut (WARM..WARM + 25).filter(|id| ![WARM + 12, WARM + 13].contains(id)));
    let touch = felt(&mut engine, &frame);
    assert!(touch.flags.contains(TouchFlags::INCOMPLETE | TouchFlags::NO_GRADIENT));
    assert_eq!((touch.warmest_taxel, touch.coldest_taxel), (Some(WARM + 13), Some(WARM + 12)));
    assert!(touch.temperature_gradient_kelvin_per_m.is_none());
    lose(&mut frame, &engine, &mut (WARM..WARM + 25));
    frame.t_s = 0.1;
    let touch = felt(&mut engine, &frame);
    assert!(touch.flags.contains(TouchFlags::INCOMPLETE) && !touch.flags.contains(TouchFlags::NO_GRADIENT));
    assert!(touch.temperature_celsius.is_none() && touch.warmest_celsius.is_none() && touch.warmest_taxel.is_none());
}

/// Two links side by side under one surface: three pressure taxels on `near` and two on `far`, in a row 5 mm apart along x, each with one
/// of temperature.
fn pair() -> Body {
    let mut glb = Glb::new();
    let far_m = DVec3::new(3.0 * PITCH, 0.0, 0.0);
    let mut links = Vec::new();
    for (name, at, ids) in [("near", DVec3::ZERO, 0..3), ("far", far_m, 3..5)] {
        let link = glb.node(name, None, at);
        for (first, modality) in [(0, Modality::Pressure), (WARM, Modality::Temperature)] {
            let taxel = |id: u32| Taxel {
                id: first + id,
                link: 0,
                position_in_link: DVec3::new(PITCH * f64::from(id), 0.0, 0.0) - at,
                normal_in_link: DVec3::Y,
                area: PITCH * PITCH,
                modality,
                tangent_in_link: None,
            };
            glb.taxels(&format!("{name} {first}"), Some(link), &ids.clone().map(taxel).collect::<Vec<_>>(), None);
        }
        let members = ids.map(|id| (id, Default::default())).collect();
        let field = somatic::body::FieldSpec { name: name.into(), parent: None, members, chart: None };
        glb.field(&field, Some(link), DVec3::ZERO);
        links.push(link);
    }
    // A strip from half a taxel before the first to half a taxel behind the last, of which each link carries its part.
    let corners = || (0..=5_u8).flat_map(|column| [(column, -0.5), (column, 0.5)]);
    let at = |(column, side): (u8, f64)| PITCH * DVec3::new(f64::from(column) - 0.5, 0.0, side);
    let of_far = |(column, _): (u8, f64)| (f32::from(column) - 2.5).clamp(0.0, 1.0);
    let weights = |corner| [1.0 - of_far(corner), of_far(corner), 0.0, 0.0];
    let skinning = Skinning { joints: vec![[0, 1, 0, 0]; 12], weights: corners().map(weights).collect() };
    let mesh = MeshData {
        positions: corners().map(|corner| at(corner).as_vec3().to_array()).collect(),
        normals: vec![[0.0, 1.0, 0.0]; 12],
        triangles: (0..5_u32).map(|column| 2 * column).flat_map(|a| [[a, a + 1, a + 3], [a, a + 3, a + 2]]).collect(),
        skinning: Some(skinning),
    };
    let binds = [DVec3::ZERO, -far_m].map(|at| Mat4::from_translation(at.as_vec3()).to_cols_array());
    let (shown, skin) = (glb.node("skin", None, DVec3::ZERO), glb.skin("skin", &links, &binds));
    glb.mesh(shown, "skin", &mesh, None, Some(skin));
    Body::from_bytes("pair", &glb.to_bytes().unwrap()).unwrap()
}

#[test]
fn the_warmest_and_the_coldest_taxel_of_a_touch_are_where_their_links_have_them() {
    let body = pair();
    let values: Vec<(String, f64)> =
        (0..5).flat_map(|id| [(id.to_string(), 1.0), ((WARM + id).to_string(), 20.0 + f64::from(id))]).collect();
    let values: Vec<(&str, f64)> = values.iter().map(|(name, value)| (name.as_str(), *value)).collect();
    let turn = DQuat::from_rotation_z(0.5);
    let near = Pose { translation: DVec3::Z, rotation: DQuat::from_rotation_x(FRAC_PI_2) };
    let far = Pose { translation: DVec3::new(0.1, 0.2, 0.3), rotation: turn };
    // glTF's places are in single precision.
    let same = |a: Option<DVec3>, b: DVec3| assert!((a.unwrap() - b).length() < 1e-8, "{a:?} is not {b}");
    for kind in backends() {
        let (mut engine, mut frame) = calibrated(&body, kind, "", &values);
        // At rest both are in the frame of the link with most of it.
        let touch = felt(&mut engine, &frame);
        assert_eq!((touch.warmest_taxel, touch.coldest_taxel), (Some(WARM + 4), Some(WARM)));
        assert!(touch.flags.contains(TouchFlags::SEVERAL_LINKS) && !touch.in_world);
        assert_eq!(body.links[touch.link as usize].name, "near");
        same(touch.warmest_position, DVec3::new(4.0 * PITCH, 0.0, 0.0));
        same(touch.coldest_position, DVec3::ZERO);
        // Beside a link whose pose is known, one without a pose is as at rest.
        (frame.t_s, frame.pose) = (0.1, vec![("near".into(), near)]);
        let touch = felt(&mut engine, &frame);
        assert!(touch.in_world);
        same(touch.warmest_position, near.rotation * DVec3::new(4.0 * PITCH, 0.0, 0.0) + DVec3::Z);
        // Each is where its own link is.
        (frame.t_s, frame.pose) = (0.2, vec![("near".into(), near), ("far".into(), far)]);
        let touch = felt(&mut engine, &frame);
        same(touch.warmest_position, turn * DVec3::new(PITCH, 0.0, 0.0) + far.translation);
        same(touch.coldest_position, near.translation);
        // In a touch of the other link alone, in its frame; without readings nowhere.
        (frame.t_s, frame.pose) = (0.3, Vec::new());
        for id in 0..3 {
            frame.values[engine.index_of(&id.to_string()).unwrap()] = RawValue::new(0.0);
        }
        let touch = felt(&mut engine, &frame);
        assert_eq!(body.links[touch.link as usize].name, "far");
        same(touch.warmest_position, DVec3::new(PITCH, 0.0, 0.0));
        same(touch.coldest_position, DVec3::ZERO);
        for id in 3..5 {
            frame.values[engine.index_of(&(WARM + id).to_string()).unwrap()] = RawValue::MISSING;
        }
        frame.t_s = 0.4;
        let touch = felt(&mut engine, &frame);
        assert!(touch.warmest_position.is_none() && touch.coldest_position.is_none());
    }
}
