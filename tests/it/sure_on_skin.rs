//! How sure touches of the whole body say they are, held against how far noise makes them stray.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use somatic::body::{FieldSpec, MemberSpec, Modality, Taxel};
use somatic::internal::body::{Glb, MeshData};
use somatic::{
    BackendKind, Body, Calibration, Engine, Frame, Options, Outputs, RawValue, Scene, Touch, TouchFlags, TouchOutputs,
    touch,
};

use crate::common::backends;
use crate::random::Random;

/// Distance between taxels, m, and the noise of a raw value, counts.
const PITCH: f64 = 6e-3;
const NOISE: f64 = 0.7;
const DRAWS: usize = 2000;
/// Taxels from the middle to the rim, each way.
const HALF: i32 = 8;

/// A normal number.
fn normal(random: &mut Random) -> f64 {
    let (a, b) = (1.0 - random.unit(), random.unit());
    (-2.0 * a.ln()).sqrt() * (2.0 * PI * b).cos()
}

/// A skin of square cells that is bent around its link's z: where it is `along` and `up`, with the outward normal there. Its middle
/// looks along +y, so that the chart of a touch there has its u along +x and its v along −z.
fn place(radius_m: Option<f64>, along: f64, up: f64) -> (DVec3, DVec3) {
    match radius_m {
        None => (DVec3::new(along, 0.0, up), DVec3::Y),
        Some(radius_m) => {
            let (sin, cos) = (along / radius_m).sin_cos();
            (DVec3::new(radius_m * sin, radius_m * (cos - 1.0), up), DVec3::new(sin, cos, 0.0))
        }
    }
}

fn skin(radius_m: Option<f64>) -> Body {
    let mut glb = Glb::new();
    let link = glb.node("skin", None, DVec3::ZERO);
    let rows = || (-HALF..=HALF).flat_map(|row| (-HALF..=HALF).map(move |column| (column, row)));
    let taxel = |(id, (column, row)): (u32, (i32, i32))| {
        let (position_in_link, normal_in_link) = place(radius_m, f64::from(column) * PITCH, f64::from(row) * PITCH);
        Taxel {
            id,
            link: 0,
            position_in_link,
            normal_in_link,
            area: PITCH * PITCH,
            modality: Modality::Pressure,
            tangent_in_link: None,
        }
    };
    let taxels: Vec<Taxel> = (0..).zip(rows()).map(taxel).collect();
    glb.taxels("taxels", Some(link), &taxels, None);
    // Four facets a cell each way.
    let across = 4 * (2 * HALF as u32 + 1);
    let mut mesh = MeshData { positions: Vec::new(), normals: Vec::new(), triangles: Vec::new(), skinning: None };
    let at = |step: u32| (f64::from(step) / 4.0 - f64::from(HALF) - 0.5) * PITCH;
    for (i, j) in (0..=across).flat_map(|j| (0..=across).map(move |i| (i, j))) {
        let (position, normal) = place(radius_m, at(i), at(j));
        mesh.positions.push(position.as_vec3().to_array());
        mesh.normals.push(normal.as_vec3().to_array());
        if i < across && j < across {
            let corner = j * (across + 1) + i;
            let (right, above) = (corner + 1, corner + across + 1);
            mesh.triangles.extend([[corner, above, right], [right, above, above + 1]]);
        }
    }
    let node = glb.node("surface", Some(link), DVec3::ZERO);
    glb.mesh(node, "surface", &mesh, None, None);
    let members = (0..taxels.len() as u32).map(|id| (id, MemberSpec::default())).collect();
    glb.field(&FieldSpec { name: "all".into(), parent: None, members, chart: None }, Some(link), DVec3::ZERO);
    Body::from_bytes("skin", &glb.to_bytes().unwrap()).unwrap()
}

/// What taxels read without noise of a long press, 14 by 7 mm, turned by 0.5 rad.
fn press() -> Vec<f64> {
    let along = DVec2::from_angle(0.5);
    let rows = (-HALF..=HALF).flat_map(|row| (-HALF..=HALF).map(move |column| (column, row)));
    rows.map(|(column, row)| {
        let way = DVec2::new(f64::from(column) * PITCH - 1e-3, f64::from(row) * PITCH + 0.5e-3);
        let parts = DVec2::new(way.dot(along) / 0.014, way.perp_dot(along) / 0.007);
        300.0 * (-0.5 * parts.length_squared()).exp()
    })
    .collect()
}

fn engine(body: &Body, calibration: &str, outputs: TouchOutputs, backend: BackendKind) -> Engine {
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Calibration::parse(calibration, &ids).unwrap();
    let asked = touch::Options { outputs, ..touch::Options::default() };
    let scene = Scene::default().outputs(Outputs::TOTAL).touches(asked);
    Engine::new(body, Options::default().scene(scene).calibration(calibration).backend(backend).batch(64)).unwrap()
}

fn soft(keys: &str) -> String {
    format!("[all]\ndead_band = 5\nonset = \"soft\"\nnoise = {NOISE}\n{keys}\n")
}

fn noisy(count: usize, sigma: f64) -> Vec<Frame> {
    let mut random = Random::new(5);
    let clean = press();
    let frame = |number: usize| {
        let values = clean.iter().map(|value| RawValue::new(value + sigma * normal(&mut random))).collect();
        Frame { t_s: 0.01 * number as f64, values, ..Frame::default() }
    };
    (0..count).map(frame).collect()
}

/// The standard deviation of numbers.
fn spread(numbers: &[f64]) -> f64 {
    let mean = numbers.iter().sum::<f64>() / numbers.len() as f64;
    (numbers.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (numbers.len() - 1) as f64).sqrt()
}

#[test]
fn touches_stray_by_noise_as_far_as_they_say_on_planes_and_around_limbs() {
    let outputs = TouchOutputs::USUAL | TouchOutputs::SIGMAS;
    for (radius_m, keys) in [
        (None, "unit = \"kPa\""),
        (None, "sensors = \"cell\""),
        (Some(0.04), "unit = \"N\""),
        (Some(0.04), "unit = \"kPa\""),
    ] {
        let body = skin(radius_m);
        let percepts =
            engine(&body, &soft(keys), outputs, BackendKind::Cpu).process(&noisy(DRAWS, NOISE)).unwrap().clone();
        let found: Vec<&Touch> = (0..DRAWS)
            .map(|frame| {
                let touches = &percepts.touches(frame).unwrap().touches;
                touches.iter().max_by(|a, b| a.total.total_cmp(&b.total)).unwrap()
            })
            .collect();
        let of = |what: &dyn Fn(&Touch) -> f64| -> Vec<f64> { found.iter().map(|touch| what(touch)).collect() };
        let strayed = [
            spread(&of(&|touch: &Touch| touch.total)),
            spread(&of(&|touch: &Touch| touch.position.x)),
            spread(&of(&|touch: &Touch| touch.position.z)),
            // v runs along −z: the axis, at −0.5 rad, is far from where angles begin anew, at 0.
            spread(&of(&|touch: &Touch| touch.principal_axis_rad.unwrap())),
        ];
        let said = |touch: &Touch| {
            let [u, v] = touch.position_sigma_m.unwrap();
            [touch.total_sigma.unwrap(), u, v, touch.principal_axis_sigma_rad.unwrap()]
        };
        let names = ["total", "position u", "position v", "principal axis"];
        for (index, name) in names.into_iter().enumerate() {
            let squares: f64 = found.iter().map(|touch| said(touch)[index].powi(2)).sum();
            let right = (squares / DRAWS as f64).sqrt();
            println!("{radius_m:?} {keys} {name}: strayed by {:e}, said {right:e}", strayed[index]);
            let ratio = strayed[index] / right;
            assert!((ratio - 1.0).abs() < 0.1, "{radius_m:?} {keys} {name}: {ratio}");
        }
        assert!(found.iter().all(|touch| !touch.flags.intersects(TouchFlags::UNSURE | TouchFlags::NOISE_UNKNOWN)));
        // Negative control: twice the noise is more than is said.
        let doubled =
            engine(&body, &soft(keys), outputs, BackendKind::Cpu).process(&noisy(300, 2.0 * NOISE)).unwrap().clone();
        let totals: Vec<f64> = (0..300)
            .map(|frame| doubled.touches(frame).unwrap().touches.iter().map(|touch| touch.total).fold(0.0, f64::max))
            .collect();
        assert!(spread(&totals) > 1.5 * strayed[0]);
    }
}

#[test]
fn every_backend_is_as_sure_and_without_noise_or_neighbours_none_is() {
    let body = skin(Some(0.04));
    let frames = noisy(20, NOISE);
    let asked = TouchOutputs::USUAL | TouchOutputs::SIGMAS;
    let of = |keys: &str, outputs: TouchOutputs, frames: &[Frame], backend: BackendKind| -> Vec<Touch> {
        let percepts = engine(&body, keys, outputs, backend).process(frames).unwrap().clone();
        (0..frames.len()).flat_map(|frame| percepts.touches(frame).unwrap().touches.clone()).collect()
    };
    let sigmas = |touches: &[Touch]| -> Vec<_> {
        let of = |touch: &Touch| (touch.total_sigma, touch.position_sigma_m, touch.principal_axis_sigma_rad);
        touches.iter().map(of).collect()
    };
    let right = sigmas(&of(&soft("unit = \"N\""), asked, &frames, BackendKind::Reference));
    assert!(right.len() >= 20 && right.iter().any(|(_, _, axis)| axis.is_some()));
    for backend in backends() {
        let found = sigmas(&of(&soft("unit = \"N\""), asked, &frames, backend));
        assert_eq!(found, right, "{backend:?}");
    }
    let cpu = |keys: &str, outputs: TouchOutputs, frames: &[Frame]| of(keys, outputs, frames, BackendKind::Cpu);
    // Nobody knows the noise.
    for touch in cpu("[all]\ndead_band = 5\n", asked, &frames) {
        assert!(touch.flags.contains(TouchFlags::NOISE_UNKNOWN) && !touch.flags.contains(TouchFlags::UNSURE));
        assert_eq!((touch.total_sigma, touch.position_sigma_m, touch.principal_axis_sigma_rad), (None, None, None));
    }
    // What is not asked for is absent, and nothing is said of it.
    for touch in cpu("[all]\ndead_band = 5\n", TouchOutputs::USUAL, &frames) {
        assert!(!touch.flags.intersects(TouchFlags::UNSURE | TouchFlags::NOISE_UNKNOWN) && touch.total_sigma.is_none());
    }
    let total = cpu(&soft(""), TouchOutputs::USUAL | TouchOutputs::TOTAL_SIGMA, &frames[..1]);
    assert!(total[0].total_sigma.is_some() && total[0].position_sigma_m.is_none());
    // A hard onset jumps at the rim.
    let hard = soft("").replace("\"soft\"", "\"hard\"");
    assert!(cpu(&hard, asked, &frames).iter().any(|touch| touch.flags.contains(TouchFlags::UNSURE)));
    // One taxel tells nothing of its neighbours.
    let mut one = frames[0].clone();
    one.values.fill(RawValue::new(0.0));
    one.values[40] = RawValue::new(100.0);
    let alone = cpu(&soft(""), asked, &[one]);
    assert_eq!(alone.len(), 1);
    assert!(alone[0].flags.contains(TouchFlags::ONE_TAXEL) && alone[0].total_sigma.is_none());
    assert!(!alone[0].flags.contains(TouchFlags::UNSURE));
    // A strap goes 280° around a limb: it has no chart, and so only its total's.
    let around = skin(Some(0.0195));
    let mut strap = frames[0].clone();
    for (index, value) in strap.values.iter_mut().enumerate() {
        let row = index as i32 / (2 * HALF + 1) - HALF;
        *value = RawValue::new(if row.abs() < 2 { 100.0 + index as f64 % 7.0 } else { 0.0 });
    }
    let percepts = engine(&around, &soft("unit = \"N\""), asked, BackendKind::Cpu).process(&[strap]).unwrap().clone();
    let [touch] = &percepts.touches(0).unwrap().touches[..] else { panic!("one strap") };
    assert!(
        touch.flags.contains(TouchFlags::WRAPPED) && !touch.flags.contains(TouchFlags::UNSURE),
        "{:?}",
        touch.flags
    );
    assert!(touch.total_sigma.is_some() && touch.position_sigma_m.is_none());
    assert!(touch.principal_axis.is_some() && touch.principal_axis_sigma_rad.is_none());
}
