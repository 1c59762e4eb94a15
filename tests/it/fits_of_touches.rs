//! Every touch of the whole body has a fit of its own.

use glam::{DVec2, DVec3};
use somatic::source::{SimulatedSource, Source};
use somatic::touch;
use somatic::{
    BackendKind, Body, Calibration, Engine, Frame, Options, Outputs, Percepts, Scene, TouchFlags, TouchOutputs,
};

use crate::common::Flat;

/// Two balls on a grid of 5 mm, one pressed harder than the other, that wander about their own places.
const TWO_BALLS: &str = "rate_hz = 20\nduration_s = 5\n[layer]\nthickness_m = 0.004\n[sensor]\nkind = \"ideal\"\nnoise_sigma = 0.01\n\
    [[touch]]\nname = \"left\"\non = \"grid\"\nindenter = \"ball\"\nradius_m = 0.0127\nhold = { newton = 3 }\n\
    path = [[-0.022, -0.004], [-0.018, 0.005]]\ntimes_s = [0, 5]\n\
    [[touch]]\nname = \"right\"\non = \"grid\"\nindenter = \"ball\"\nradius_m = 0.0127\nhold = { newton = 6 }\n\
    path = [[0.018, 0.003], [0.023, -0.006]]\ntimes_s = [0, 5]\n";

fn grid() -> Body {
    let places: Vec<[f64; 2]> =
        (-8..=8).flat_map(|i| (-8..=8).map(move |j| [f64::from(i) * 5e-3, f64::from(j) * 5e-3])).collect();
    let mut body = Flat::new(&places).field("grid", None, 0..places.len() as u32).surface(0.5).body();
    body.taxels.iter_mut().for_each(|taxel| taxel.area = 2.5e-5);
    body
}

/// The percepts of the two balls, and where each was in each frame.
fn pressed_in(scene: Scene, backend: BackendKind, layered: bool) -> (Percepts, Vec<[DVec2; 2]>) {
    let body = grid();
    let mut source = SimulatedSource::on_body("two-balls", TWO_BALLS, body.clone()).unwrap();
    let mut calibration = source.calibration();
    if !layered {
        calibration.truncate(calibration.find("\n[layer]").unwrap());
    }
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Calibration::parse(&calibration, &ids).unwrap();
    let options = Options::default().scene(scene).calibration(calibration).backend(backend).batch(256);
    let mut engine = Engine::new(&body, options).unwrap();
    engine.set_channels(source.taxels()).unwrap();
    let (mut frames, mut truths) = (Vec::new(), Vec::new());
    let mut frame = Frame::missing(0.0, source.taxels().len());
    while source.next_frame(&mut frame).unwrap() {
        truths.push([0, 1].map(|ball| DVec2::from_array(source.truth()[ball].uv.unwrap())));
        frames.push(frame.clone());
    }
    (engine.process(&frames).unwrap().clone(), truths)
}

fn fitted() -> Scene {
    let asked = touch::Options { outputs: TouchOutputs::all(), ..touch::Options::default() };
    Scene::default().outputs(Outputs::TOTAL).touches(asked).fields(["grid"])
}

#[test]
fn each_touch_has_a_fit_of_its_own_or_says_why_not() {
    let (percepts, truths) = pressed_in(fitted(), BackendKind::Cpu, true);
    let (mut means, mut fits) = (Vec::new(), Vec::new());
    for (frame, truth) in truths.iter().enumerate() {
        let touches = &percepts.touches(frame).unwrap().touches;
        assert_eq!(touches.len(), 2, "frame {frame}");
        for touch in touches {
            let Some(fit) = touch.fit else {
                assert!(!touch.flags.is_empty(), "{touch:?}");
                continue;
            };
            let mean = flat(touch.position);
            let nearest = truth.iter().copied().min_by(|a, b| a.distance(mean).total_cmp(&b.distance(mean))).unwrap();
            means.push(mean.distance(nearest));
            fits.push(flat(fit.place).distance(nearest));
        }
    }
    let rms = |errors: &[f64]| 1e3 * (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    let [mean_mm, fit_mm] = [&means, &fits].map(|errors| rms(errors));
    println!("{} of 200 touches: mean {mean_mm:.3} mm, fit {fit_mm:.3} mm", fits.len());
    assert!(fits.len() > 180 && fit_mm < 0.65 * mean_mm, "{} {fit_mm} {mean_mm}", fits.len());
    let (without, _) = pressed_in(fitted(), BackendKind::Cpu, false);
    let touches = (0..without.frames()).flat_map(|frame| &without.touches(frame).unwrap().touches);
    assert!(touches.into_iter().all(|touch| touch.fit.is_none() && touch.flags.contains(TouchFlags::NO_LAYER)));
}

#[test]
fn touches_have_the_same_fits_on_every_backend() {
    let of = |backend| {
        let (percepts, _) = pressed_in(fitted(), backend, true);
        let fits = |frame| percepts.touches(frame).unwrap().touches.iter().map(|touch| touch.fit).collect::<Vec<_>>();
        (0..percepts.frames()).flat_map(fits).collect::<Vec<_>>()
    };
    let right = of(BackendKind::Reference);
    assert!(right.iter().flatten().count() > 180);
    // Made of raw values, in double precision.
    crate::common::backends().into_iter().for_each(|backend| assert_eq!(of(backend), right, "{backend:?}"));
}

/// The grid lies in its link's x and −z.
fn flat(p: DVec3) -> DVec2 {
    DVec2::new(p.x, -p.z)
}

#[test]
fn the_speed_of_a_rod_is_that_of_its_fits() {
    let body = Body::from_bytes("hand", somatic::bundled::HAND).unwrap();
    // Across itself, at 45°, at 10 mm/s.
    let text = "rate_hz = 50\nduration_s = 1.6\n[layer]\nthickness_m = 0.007\n[sensor]\nkind = \"fsr\"\nwiper = 38\nnoise_sigma = 1\n\
                [[touch]]\non = \"hand/back\"\nindenter = \"rod\"\nradius_m = 0.0127\nlength_m = 0.05\nangle_deg = 45\n\
                hold = { newton = 30 }\npath = [[0.0057, -0.0057], [-0.0057, 0.0057]]\ntimes_s = [0, 1.6]\n";
    let mut source = SimulatedSource::on_body("rod", text, body.clone()).unwrap();
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Calibration::parse(&source.calibration(), &ids).unwrap();
    let filter = somatic::scene::MotionFilter::default().over_s(0.2);
    let asked =
        touch::Options { outputs: TouchOutputs::USUAL | TouchOutputs::FIT_VELOCITY, ..touch::Options::default() };
    let scene = Scene::default().outputs(Outputs::FILTERED_SPEED).filter(filter).touches(asked).fields(["hand/back"]);
    let options = Options::default().scene(scene).calibration(calibration).backend(BackendKind::Cpu).batch(16);
    let mut engine = Engine::new(&body, options).unwrap();
    engine.set_channels(source.taxels()).unwrap();
    let (mut fits, mut centroids) = (Vec::new(), Vec::new());
    let mut frame = Frame::missing(0.0, source.taxels().len());
    let mut young = 0;
    while source.next_frame(&mut frame).unwrap() {
        let percepts = engine.process_one(&frame).unwrap();
        let touches = percepts.touches(0).unwrap().touches.iter();
        let touch = touches.max_by(|a, b| a.total.total_cmp(&b.total)).unwrap();
        let velocity = touch.fit.and_then(|fit| fit.velocity);
        let off = |speed: f64| (speed / 0.01008 - 1.0).powi(2);
        fits.extend(velocity.map(|velocity| off(velocity.length())));
        centroids.extend(percepts.get(0, 0).filtered_speed.map(off));
        // Motion is over 0.2 s: there is none yet in the first ten frames.
        young += usize::from(velocity.is_none() && touch.flags.intersects(TouchFlags::YOUNG | TouchFlags::YOUNG_FIT));
        if let (Some(velocity), Some(truth)) = (velocity, source.truth()[0].velocity_in_link) {
            assert!(velocity.angle_between(truth) < 0.1, "it moves across itself: {velocity}, {truth}");
        }
    }
    let rms = |squares: &[f64]| 100.0 * (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    println!(
        "speed over 0.2 s: centroids {:.1} %, {} fits {:.1} %, {young} young",
        rms(&centroids),
        fits.len(),
        rms(&fits)
    );
    assert!(fits.len() > 60 && rms(&fits) < 4.0 && rms(&fits) < 0.4 * rms(&centroids) && young >= 10);
}

/// A ball that is drawn over the grid at 20 mm/s and a little to the side.
const DRAWN: &str = "rate_hz = 100\nduration_s = 1.6\n[layer]\nthickness_m = 0.004\n[sensor]\nkind = \"ideal\"\nnoise_sigma = 0.005\n\
    [[touch]]\non = \"grid\"\nindenter = \"ball\"\nradius_m = 0.0127\nhold = { newton = 5 }\n\
    path = [[-0.016, -0.004], [0.016, 0.004]]\ntimes_s = [0, 1.6]\n";

/// Without fits from frame 60 to 65, and from 80 to 120: only three taxels are pressed then, fewer than a contact has parameters.
fn drawn() -> (Body, Calibration, Vec<Frame>) {
    let body = grid();
    let mut source = SimulatedSource::on_body("drawn", DRAWN, body.clone()).unwrap();
    let calibration = Calibration::parse(&source.calibration(), source.taxels()).unwrap();
    let (mut frames, mut frame) = (Vec::new(), Frame::missing(0.0, source.taxels().len()));
    while source.next_frame(&mut frame).unwrap() {
        if (60..65).contains(&frames.len()) || (80..120).contains(&frames.len()) {
            let value = |value: &somatic::RawValue| value.number().unwrap_or(0.0);
            let mut pressed: Vec<f64> = frame.values.iter().map(value).collect();
            pressed.sort_by(|a, b| b.total_cmp(a));
            let lower = |own: &mut somatic::RawValue| {
                if value(own) < pressed[1] {
                    *own = somatic::RawValue::new(0.0);
                }
            };
            frame.values.iter_mut().for_each(lower);
        }
        frames.push(frame.clone());
    }
    (body, calibration, frames)
}

#[test]
fn a_fit_has_the_velocity_of_what_presses_and_the_same_bits_however_a_recording_is_cut() {
    let (body, calibration, frames) = drawn();
    let engine = |outputs: TouchOutputs| {
        let asked = touch::Options { outputs, ..touch::Options::default() };
        let scene = Scene::default().outputs(Outputs::TOTAL).touches(asked);
        let options =
            Options::default().scene(scene).calibration(calibration.clone()).backend(BackendKind::Cpu).batch(256);
        Engine::new(&body, options).unwrap()
    };
    let asked = TouchOutputs::USUAL | TouchOutputs::FIT;
    let whole = engine(asked).process(&frames).unwrap().clone();
    // u runs along the link's x and v along its −z.
    let right = DVec3::new(0.02, 0.0, -0.005);
    let (mut squares, mut compared, mut without) = (0.0, 0, 0);
    for frame in 0..frames.len() {
        let [touch] = &whole.touches(frame).unwrap().touches[..] else { panic!("frame {frame}") };
        assert_eq!(touch.id, 1, "frame {frame}");
        let velocity = touch.fit.and_then(|fit| fit.velocity);
        let is_young_fit = touch.flags.contains(TouchFlags::YOUNG_FIT);
        assert_eq!(touch.flags.contains(TouchFlags::YOUNG), frame < 20, "frame {frame}");
        let has_fits = !(60..65).contains(&frame) && !(80..120).contains(&frame);
        assert!(has_fits || (touch.fit.is_none() && !is_young_fit), "frame {frame}: {touch:?}");
        if touch.fit.is_none() {
            without += usize::from(has_fits);
            continue;
        }
        match frame {
            0..20 => assert!(velocity.is_none() && !is_young_fit, "frame {frame}"),
            120..140 => assert!(velocity.is_none() && is_young_fit, "frame {frame}"),
            // If the first of these had no fit.
            20..25 | 140..145 => {}
            _ => assert!(velocity.is_some() && !is_young_fit, "frame {frame}"),
        }
        if let Some(velocity) = velocity {
            assert!(velocity.y.abs() < 1e-9, "on the skin: {velocity}");
            (squares, compared) = (squares + velocity.distance_squared(right), compared + 1);
        }
    }
    let rms = (squares / f64::from(compared)).sqrt();
    println!("velocity of {compared} fits: {:.2} mm/s of 20.6 off", 1e3 * rms);
    assert!(compared > 60 && without < 12 && rms < 0.15 * right.length(), "{compared} {without} {rms}");

    let mut alone = engine(asked);
    for (index, frame) in frames.iter().enumerate() {
        assert_eq!(alone.process_one(frame).unwrap().touches(0), whole.touches(index), "frame {index}");
    }
    for cut in [11, 50, 63, 90, 125] {
        let mut first = engine(asked);
        first.process(&frames[..cut]).unwrap();
        let state = first.state().unwrap();
        let mut second = engine(asked);
        second.restore(&state).unwrap();
        let rest = second.process(&frames[cut..]).unwrap();
        for index in cut..frames.len() {
            assert_eq!(rest.touches(index - cut), whole.touches(index), "cut at {cut}, frame {index}");
        }
    }
    // What nobody asks for is absent, with its flag.
    let plain = engine(TouchOutputs::USUAL | TouchOutputs::FIT_PLACE).process(&frames).unwrap().clone();
    for frame in 0..frames.len() {
        let touches = &plain.touches(frame).unwrap().touches;
        let velocity = touches.iter().find_map(|touch| touch.fit.and_then(|fit| fit.velocity));
        assert!(velocity.is_none() && touches.iter().all(|touch| !touch.flags.contains(TouchFlags::YOUNG_FIT)));
    }
}
