//! Gains and the layer's width from ordinary touches, against those that a simulation has.

use glam::DVec2;
use somatic::internal::gains::{GainsEstimate, GainsSurvey};
use somatic::source::{SimulatedSource, Source};
use somatic::{Body, Calibration, Engine, Frame, Options, Outputs, Scene, TouchOutputs, touch};

use crate::common::Flat;

/// 13 × 13 sensors, 5 mm apart, without gaps.
fn grid() -> Body {
    let at = |k: i32| f64::from(k) * 5e-3;
    let places: Vec<[f64; 2]> = (-6..=6).flat_map(|i| (-6..=6).map(move |j| [at(i), at(j)])).collect();
    let mut body = Flat::new(&places).field("grid", None, 0..places.len() as u32).surface(0.5).body();
    body.taxels.iter_mut().for_each(|taxel| taxel.area = 25e-6);
    body
}

const LAYERS: [&str; 2] = ["", "kernel = \"boussinesq\"\n"];
/// Standard deviations of raw values, where a newton is 500.
const NOISES: [u32; 2] = [1, 8];

/// A finger that wanders over the grid for two minutes with 2 to 6 N, under a layer with a σ of 2.3 mm; gains differ by ±20 %, and raw
/// values have `noise`.
fn wandering(layer: &str, noise: u32, seconds: u32, seed: u32) -> String {
    wandering_finger("", layer, noise, seconds, seed)
}

/// The same of a finger with the keys `finger`.
fn wandering_finger(finger: &str, layer: &str, noise: u32, seconds: u32, seed: u32) -> String {
    let mut state = seed;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 24)
    };
    let (mut path, mut times, mut forces) = (String::new(), String::new(), String::new());
    for t in 0..=seconds {
        path += &format!("[{}, {}],", 0.05 * (random() - 0.5), 0.05 * (random() - 0.5));
        times += &format!("{t},");
        forces += &format!("[{t}, {}],", 2.0 + 4.0 * random());
    }
    format!(
        "rate_hz = 25\nduration_s = {seconds}\nseed = {seed}\n[layer]\nthickness_m = {}\n{layer}[sensor]\nkind = \"linear\"\nbits = 10\n\
         gain = 500\nnoise_sigma = {noise}\ngain_spread = 0.2\ngain_seed = 4\n[[touch]]\non = \"grid\"\nindenter = \"fingertip\"\n{finger}\
         path = [{path}]\ntimes_s = [{times}]\nforce_newton = [{forces}]\n",
        2.3e-3 * 3.0_f64.sqrt()
    )
}

fn ids(body: &Body) -> Vec<u32> {
    body.taxels.iter().map(|taxel| taxel.id).collect()
}

fn frames(source: &mut SimulatedSource) -> (Vec<Frame>, Vec<DVec2>) {
    let (mut frames, mut places) = (Vec::new(), Vec::new());
    let mut frame = Frame::missing(0.0, source.taxels().len());
    while source.next_frame(&mut frame).unwrap() {
        places.extend(source.truth().first().map(|truth| DVec2::from_array(truth.uv.unwrap())));
        frames.push(frame.clone());
    }
    (frames, places)
}

fn estimated(body: &Body, source: &mut SimulatedSource, onset: &str) -> GainsEstimate {
    let text = source.calibration().replace("[all]\n", &format!("[all]\nonset = \"{onset}\"\n"));
    let calibration = Calibration::parse(&text, &ids(body)).unwrap();
    let mut survey = GainsSurvey::new(body, calibration, source.taxels()).unwrap();
    survey.add(&frames(source).0).unwrap();
    survey.finish(&mut |_| true).unwrap()
}

/// Root mean squares of log gains as they are, and of what is wrong with the estimate, both without their means.
fn off(estimate: &GainsEstimate, gains: &[f64]) -> [f64; 2] {
    let reported: Vec<[f64; 2]> = estimate
        .gains
        .iter()
        .zip(gains)
        .filter_map(|(reported, gain)| Some([gain.ln(), gain.ln() - reported.as_ref()?.ln()]))
        .collect();
    [0, 1].map(|column| {
        let mean = reported.iter().map(|row| row[column]).sum::<f64>() / reported.len() as f64;
        (reported.iter().map(|row| (row[column] - mean).powi(2)).sum::<f64>() / reported.len() as f64).sqrt()
    })
}

/// Errors of the places of fits on other touches, root mean square, mm, and of how many: with a calibration whose gains are divided
/// by `gains` and whose layer has the σ that is given.
fn places(
    body: &Body,
    source: &mut SimulatedSource,
    gains: &dyn Fn(usize) -> f64,
    sigma_m: f64,
    spread: f64,
) -> (f64, usize) {
    let mut calibration = Calibration::parse(&source.calibration(), &ids(body)).unwrap();
    for (index, taxel) in calibration.taxels.iter_mut().enumerate() {
        taxel.gain /= gains(index);
    }
    calibration.layer = calibration.layer.map(|mut layer| {
        (layer.sigma_m, layer.gain_spread) = (sigma_m, spread);
        layer
    });
    let asked = touch::Options { outputs: TouchOutputs::FIT_PLACE, ..touch::Options::default() };
    let scene = Scene::default().outputs(Outputs::TOTAL).touches(asked);
    let mut engine = Engine::new(body, Options::default().scene(scene).calibration(calibration).batch(256)).unwrap();
    engine.set_channels(source.taxels()).unwrap();
    let (frames, truth) = frames(source);
    let percepts = engine.process(&frames).unwrap();
    let errors: Vec<f64> = (0..frames.len())
        .filter_map(|frame| {
            let [touch] = &percepts.touches(frame)?.touches[..] else { return None };
            // The grid lies in its link's x and −z.
            let place = touch.fit?.place;
            Some(1e3 * DVec2::new(place.x, -place.z).distance(truth[frame]))
        })
        .collect();
    ((errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt(), errors.len())
}

#[test]
fn gains_are_found_from_a_finger_that_wanders() {
    let body = grid();
    let all = [0, 1].map(|layer| [0, 1].map(|noise| (LAYERS[layer], NOISES[noise])));
    // Each layer and each noise once, unless the whole table is asked for.
    let cells = if std::env::var_os("SOMATIC_SEEDS").is_some() { all.concat() } else { vec![all[0][0], all[1][1]] };
    for (layer, noise) in cells {
        let mut source = SimulatedSource::on_body("finger", &wandering(layer, noise, 120, 1), body.clone()).unwrap();
        let estimate = estimated(&body, &mut source, "hard");
        let gains = source.gains().to_vec();
        let [before, after] = off(&estimate, &gains);
        let reported = estimate.gains.iter().flatten().count();
        let mut other = SimulatedSource::on_body("finger", &wandering(layer, noise, 40, 2), body.clone()).unwrap();
        let layer_m = 2.3e-3;
        let none = places(&body, &mut other, &|_| 1.0, layer_m, 0.2);
        other.seek(0);
        let own = places(&body, &mut other, &|index| estimate.gains[index].unwrap_or(1.0), estimate.sigma_m, 0.05);
        other.seek(0);
        let known = places(&body, &mut other, &|index| gains[index], layer_m, 0.05);
        println!(
            "{layer:?}, noise {noise}: {} touches, {reported} taxels; gains off by {:.1} % before and {:.1} % after; width {:.2} mm, σ {:.2} mm, left {:.3}; \
             places without gains {none:?}, with those found {own:?}, with the true ones {known:?}",
            estimate.touches,
            100.0 * before,
            100.0 * after,
            1e3 * estimate.width_m,
            1e3 * estimate.sigma_m,
            estimate.left,
        );
        assert!(before > 0.15 && after < 0.06, "{layer:?}, {noise}: {before} {after}");
        // Gains of 3 to 5 % make places a few hundredths of a millimetre worse: much where noise is low.
        let most = if noise == 1 { none.0 / 3.0 } else { 1.3 * known.0 };
        assert!(own.0 < most && known.0 < own.0, "{layer:?}, {noise}: {none:?} {own:?} {known:?}");
        assert!(own.1 * 100 > known.1 * 95, "{layer:?}, {noise}: {own:?} {known:?}");
    }
}

#[test]
fn gains_are_found_from_a_finger_that_is_longer_than_wide() {
    let body = grid();
    for layer in LAYERS {
        let text = wandering_finger("aspect = 1.25\nangle_deg = 20\n", layer, 1, 120, 1);
        let mut source = SimulatedSource::on_body("finger", &text, body.clone()).unwrap();
        let estimate = estimated(&body, &mut source, "hard");
        let [before, after] = off(&estimate, source.gains());
        println!(
            "{layer:?}: gains off by {:.1} % before and {:.1} % after; left {:.3}, gain_spread {:.3}",
            100.0 * before,
            100.0 * after,
            estimate.left,
            estimate.gain_spread
        );
        assert!(before > 0.15 && after < 0.08, "{layer:?}: {before} {after}");
        // What is written down as the spread of gains and model is no less than half of what gains are off by.
        assert!(estimate.gain_spread > 0.5 * after && estimate.gain_spread < 0.15, "{}", estimate.gain_spread);
    }
}

#[test]
fn what_a_soft_onset_takes_off_is_no_gain() {
    let body = grid();
    let mut source = SimulatedSource::on_body("finger", &wandering("", 1, 50, 1), body.clone()).unwrap();
    let hard = estimated(&body, &mut source, "hard");
    source.seek(0);
    let soft = estimated(&body, &mut source, "soft");
    // Contacts press with all of it; the same taxels are pressed, so that the same numbers come out but for rounding.
    for (hard, soft) in hard.gains.iter().zip(&soft.gains) {
        let off = hard.zip(*soft).map(|(hard, soft)| hard / soft - 1.0);
        assert_eq!(hard.is_some(), soft.is_some());
        assert!(off.is_none_or(|off| off.abs() < 1e-6), "{off:?}");
    }
}
