//! Shear, temperature and proximity of simulated touches against their truth, with noise.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use somatic::body::{ChartKind, ChartSpec, FieldSpec, MemberSpec, Modality, Taxel};
use somatic::internal::body::{Glb, MeshData};
use somatic::source::{SimulatedSource, Source as _, Truth, write_recording};
use somatic::{BackendKind, Body, Calibration, Engine, Frame, Options, OutputPath, Percept, Receptor};

const PITCH: f64 = 5e-3;
const SIDE: u32 = 13;
/// Ids of the first taxel of each kind.
const WARM: u32 = 1000;
const NEAR: u32 = 2000;
/// The taxel in the middle, of each kind.
const MIDDLE: u32 = SIDE * SIDE / 2;
/// Noise as a share of the largest force on a taxel.
const NOISE: f64 = 0.03;
const RATE_HZ: f64 = 100.0;

/// A sheet with taxels of the first `kinds` kinds every 5 mm; the tangents of those with three axes point in all directions.
fn skin(kinds: usize) -> Body {
    let mut glb = Glb::new();
    let link = glb.node("skin", None, DVec3::ZERO);
    let all = [(0, Modality::Force3), (WARM, Modality::Temperature), (NEAR, Modality::Proximity)];
    let half = f64::from(SIDE - 1) / 2.0;
    for (first, modality) in all.into_iter().take(kinds) {
        let taxel = |i: u32| {
            let turn = 0.7 * f64::from(i);
            Taxel {
                id: first + i,
                link: 0,
                position_in_link: PITCH * DVec3::new(f64::from(i % SIDE) - half, 0.0, half - f64::from(i / SIDE)),
                normal_in_link: DVec3::Y,
                area: PITCH * PITCH,
                modality,
                tangent_in_link: (modality == Modality::Force3).then(|| DVec3::new(turn.cos(), 0.0, turn.sin())),
            }
        };
        glb.taxels(&format!("taxels {first}"), Some(link), &(0..SIDE * SIDE).map(taxel).collect::<Vec<_>>(), None);
    }
    let node = glb.node("surface", Some(link), DVec3::ZERO);
    let end = 0.05;
    let mesh = MeshData {
        positions: vec![[-end, 0.0, -end], [-end, 0.0, end], [end, 0.0, end], [end, 0.0, -end]],
        normals: vec![[0.0, 1.0, 0.0]; 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        skinning: None,
    };
    glb.mesh(node, "surface", &mesh, None, None);
    let chart =
        ChartSpec { kind: ChartKind::Plane, origin_in_anchor: Some([0.0; 3]), u_in_anchor: Some([1.0, 0.0, 0.0]) };
    let ids = all.into_iter().take(kinds).flat_map(|(first, _)| (0..SIDE * SIDE).map(move |i| first + i));
    let members = ids.map(|id| (id, MemberSpec::default())).collect();
    glb.field(&FieldSpec { name: "skin".into(), parent: None, members, chart: Some(chart) }, Some(link), DVec3::ZERO);
    Body::from_bytes("skin", &glb.to_bytes().unwrap()).unwrap()
}

fn simulated(body: &Body, duration_s: f64, sensor: &str, touch: &str) -> SimulatedSource {
    let text = format!(
        "rate_hz = {RATE_HZ}\nduration_s = {duration_s}\nseed = 3\n[layer]\nthickness_m = 0.007\n{sensor}\n\
         [[touch]]\non = \"skin\"\nindenter = \"fingertip\"\n{touch}\n"
    );
    SimulatedSource::on_body("touch", &text, body.clone()).unwrap()
}

/// A moment of a simulation: what is true, and the percept of a letter.
struct Moment {
    t_s: f64,
    truth: Option<Truth>,
    percept: Percept,
    /// The largest force on a taxel.
    most_newton: f64,
    celsius: Vec<f64>,
}

/// All moments of `source`, read by its own calibration.
fn moments(mut source: SimulatedSource, receptor: Receptor) -> Vec<Moment> {
    let ids: Vec<u32> = source.body().taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Calibration::parse(&source.calibration(), &ids).unwrap();
    let options = Options::default().calibration(Some(calibration)).backend(BackendKind::Reference);
    let mut engine = Engine::new(source.body(), options).unwrap();
    assert_eq!(engine.frame(0.0).values.len(), source.taxels().len());
    let letters = engine.plan().letters();
    let letter = letters.iter().position(|letter| letter.receptor == receptor).unwrap();
    let mut frame = Frame::missing(0.0, source.taxels().len());
    let mut found = Vec::new();
    while source.next_frame(&mut frame).unwrap() {
        let percept = engine.process_one(&frame).unwrap().frame(0).find(|percept| percept.letter == letter).unwrap();
        found.push(Moment {
            t_s: frame.t_s,
            truth: source.truth().first().cloned(),
            percept,
            most_newton: source.forces_newton().iter().copied().fold(0.0, f64::max),
            celsius: source.celsius().to_vec(),
        });
    }
    found
}

/// The same with noise of 3 % of the largest force on a taxel.
fn with_noise(body: &Body, duration_s: f64, touch: &str) -> Vec<Moment> {
    let plain = moments(simulated(body, duration_s, "", touch), Receptor::Shear);
    let most = plain.iter().map(|moment| moment.most_newton).fold(0.0, f64::max);
    let sensor = format!("[sensor]\nnoise_sigma = {}", NOISE * most);
    moments(simulated(body, duration_s, &sensor, touch), Receptor::Shear)
}

fn angle_between(a: f64, b: f64) -> f64 {
    (a - b + PI).rem_euclid(TAU) - PI
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

/// A finger that presses with 4 N, and from 0.3 s on is dragged over the middle by `length_m`, along `degrees`.
fn drag(degrees: f64, length_m: f64, speed_m_s: f64, friction: f64) -> String {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let [from, to] = [-0.5 * length_m, 0.5 * length_m].map(|along| [along * cos, along * sin]);
    format!(
        "path = [{from:?}, {to:?}]\nstart_s = 0.3\nspeed_m_s = {speed_m_s}\nfriction = {friction}\n\
         press = {{ from_s = 0.05, to_s = 9, newton = 4, ramp_s = 0.1 }}"
    )
}

#[test]
fn a_drag_has_its_direction_within_a_degree() {
    let body = skin(1);
    let (mut each_frame, mut each_twentieth, mut each_drag) = (Vec::new(), Vec::new(), Vec::new());
    for turn in 0..24 {
        let degrees = 15.0 * f64::from(turn) + 4.0;
        let run = with_noise(&body, 1.3, &drag(degrees, 0.02, 0.02, 0.6));
        let off = |[u, v]: [f64; 2]| angle_between(v.atan2(u), degrees.to_radians()).to_degrees();
        let mut shears: Vec<[f64; 2]> = Vec::new();
        for moment in run.iter().filter(|moment| moment.truth.as_ref().is_some_and(|truth| truth.slips == Some(true))) {
            let truth = moment.truth.as_ref().unwrap().shear_uv.unwrap();
            assert!(off(truth).abs() < 1e-9);
            let shear = moment.percept.shear.unwrap();
            assert_eq!(moment.percept.shear_direction, Some(libm::atan2(shear[1], shear[0])));
            shears.push(shear);
        }
        let sum = |shears: &[[f64; 2]]| shears.iter().fold([0.0; 2], |[u, v], shear| [u + shear[0], v + shear[1]]);
        each_frame.extend(shears.iter().copied().map(off));
        each_twentieth.extend(shears.windows(5).map(|shears| off(sum(shears))));
        each_drag.push(off(sum(&shears)));
    }
    let [frame, twentieth, drag] = [&each_frame, &each_twentieth, &each_drag].map(|off| rms(off));
    let frames = each_frame.len();
    eprintln!("direction: {frame:.2}° RMS a frame of {frames}, {twentieth:.2}° over 50 ms, {drag:.2}° a drag");
    // Of one frame the noise itself is over a degree: 3 % of the largest force on each of about eleven taxels, over a pull of 0.6 times
    // 6.5 of those.
    assert!(frames > 2000 && twentieth <= 1.0 && drag <= 0.5 && frame < 2.0);
}

#[test]
fn a_twist_has_its_sign() {
    let body = skin(1);
    let (mut right, mut all) = (0, 0);
    for turn in 0..16 {
        let sense = if turn % 2 == 0 { 1.0 } else { -1.0 };
        let at = [2.5e-3 * f64::from(turn % 3), 1.1e-3 * f64::from(turn % 5)];
        let touch = format!(
            "path = [{at:?}]\nfriction = 0.6\ntwist_deg = [[0.3, 0], [1.3, {}]]\n\
             press = {{ from_s = 0.05, to_s = 9, newton = 4, ramp_s = 0.1 }}",
            sense * 20.0
        );
        for moment in with_noise(&body, 1.3, &touch) {
            let Some(truth) = moment.truth.filter(|truth| truth.slips == Some(true)) else { continue };
            assert!(truth.torsion.unwrap() * sense > 0.0 && truth.shear_in_link.unwrap().length() < 1e-9);
            all += 1;
            right += u32::from(moment.percept.torsion.unwrap() * sense > 0.0);
        }
    }
    eprintln!("twists: {right} of {all} have the right sign");
    assert!(all > 1000 && right * 100 >= all * 99);
}

#[test]
fn a_slip_is_seen_when_it_begins_and_not_before() {
    let body = skin(1);
    let (mut latest, mut earliest) = (0, 0);
    let (mut sticking, mut alarms, mut slips) = (0, 0, 0);
    for turn in 0..24 {
        let (friction, speed) = (0.3 + 0.05 * f64::from(turn % 8), 0.005 * f64::from(1 + turn % 6));
        let run = with_noise(&body, 1.0, &drag(15.0 * f64::from(turn), 0.5 * speed, speed, friction));
        let is_alarm = |moment: &Moment| moment.percept.slip_ratio.is_some_and(|ratio| ratio >= 0.95);
        let truth = |moment: &Moment| moment.truth.as_ref().and_then(|truth| truth.slips);
        // Once it rests, what it has dragged stays as it was, and friction alone does not say that it slips no more.
        let moving = run.iter().filter(|moment| moment.t_s < 0.79).collect::<Vec<_>>();
        let begins = moving.iter().position(|moment| truth(moment) == Some(true)).unwrap();
        let sees = moving.iter().position(|moment| is_alarm(moment)).unwrap();
        (latest, earliest) = (latest.max(sees as i64 - begins as i64), earliest.min(sees as i64 - begins as i64));
        slips += 1;
        // Held at a share of what it takes to slip.
        let short = 0.8 * stick_m(&run, speed, friction) * f64::from(1 + turn % 5) / 5.0;
        let held = with_noise(&body, 1.0, &drag(15.0 * f64::from(turn), short, speed, friction));
        for moment in moving[..begins].iter().copied().chain(&held) {
            if truth(moment) == Some(false) {
                sticking += 1;
                alarms += i32::from(is_alarm(moment));
            }
        }
    }
    eprintln!("{slips} slips seen {earliest} to {latest} frames later, {alarms} false alarms in {sticking} frames");
    assert!(latest <= 2 && earliest >= -2, "{earliest} {latest}");
    assert!(sticking > 2000 && alarms * 100 <= sticking);
}

/// How far the indenter of `run` goes before it slips, m.
fn stick_m(run: &[Moment], speed_m_s: f64, friction: f64) -> f64 {
    let pull = |moment: &Moment| Some((moment.truth.as_ref()?.slips?, moment.truth.as_ref()?.shear_in_link?.length()));
    let first = run.iter().find_map(|moment| pull(moment).filter(|&(slips, newton)| !slips && newton > 0.0)).unwrap();
    let frames = friction * 4.0 / first.1;
    frames * speed_m_s / RATE_HZ
}

#[test]
fn what_comes_is_seen_at_its_speed_before_it_touches() {
    let body = skin(3);
    for (noise_mm, speed) in [(0.0, 0.1), (0.0, 0.05), (0.5, 0.1), (0.5, 0.02)] {
        let duration = 0.08 / speed;
        let touch = format!(
            "path = [[0, 0]]\nforce_newton = [[{duration}, 0], [{}, 4]]\ngap_m = [[0, 0.082], [{duration}, 0.002]]",
            duration + 0.2
        );
        let run = moments(
            simulated(&body, duration + 0.1, &format!("[proximity]\nnoise_sigma = {noise_mm}"), &touch),
            Receptor::Proximity,
        );
        let (mut off_m, mut off_m_s) = (Vec::new(), Vec::new());
        for moment in &run {
            let (truth, near) = (moment.truth.as_ref().unwrap(), &moment.percept);
            if truth.force_newton > 0.0 {
                assert!(truth.gap_m == Some(0.0) && near.nearest.unwrap() < 2e-3);
                continue;
            }
            off_m.push(near.nearest.unwrap() - truth.gap_m.unwrap());
            if noise_mm == 0.0 {
                assert_eq!(near.nearest_taxel, Some(NEAR + MIDDLE));
            }
            if let Some(found) = near.approach_speed {
                off_m_s.push(found - speed);
            }
        }
        // Of a line through readings with this noise over 0.1 s at 100 Hz.
        let sigma =
            1e-3 * noise_mm / rms(&(-5..=5).map(|i| f64::from(i) / RATE_HZ).collect::<Vec<_>>()) / 11.0_f64.sqrt();
        eprintln!("noise {noise_mm} mm, {speed} m/s: {:.2e} m, {:.2e} m/s of {sigma:.2e}", rms(&off_m), rms(&off_m_s));
        if noise_mm == 0.0 {
            assert!(rms(&off_m) < 1e-7 && rms(&off_m_s) < 1e-5);
        } else {
            assert!(rms(&off_m) < 4e-3 * noise_mm && rms(&off_m_s) < 1.5 * sigma);
        }
    }
}

#[test]
fn a_warm_finger_warms_what_it_touches() {
    let body = skin(3);
    let touch = "path = [[0, 0]]\ncelsius = 34\npress = { from_s = 0.5, to_s = 3, newton = 4, ramp_s = 0.1 }";
    let sensor = "[temperature]\nambient_celsius = 21\ntime_constant_s = 0.4";
    let run = moments(simulated(&body, 4.0, sensor, touch), Receptor::Temperature);
    let mut warming = 0.0;
    for pair in run.windows(2) {
        let (moment, percept) = (&pair[1], &pair[1].percept);
        let presses = moment.truth.as_ref().is_some_and(|truth| truth.force_newton > 0.0);
        // Under the middle the finger's temperature, or else the air's, is what the taxel goes to.
        let target = if presses { 34.0 - 21.0 } else { 0.0 };
        warming += (target - warming) * (1.0 - (-1.0 / (RATE_HZ * 0.4)).exp());
        let warmest = percept.warmest.unwrap();
        assert!((warmest - 21.0 - warming).abs() < 1e-5, "{} {warmest} {warming}", moment.t_s);
        if warming > 0.1 {
            assert_eq!(percept.warmest_taxel, Some(WARM + MIDDLE));
        }
        let mean = |moment: &Moment| moment.celsius.iter().sum::<f64>() / moment.celsius.len() as f64;
        assert!((percept.temperature.unwrap() - mean(moment)).abs() < 1e-5);
        // Over a window of a second: the change over it is between the least and the greatest.
        if let Some(rate) = percept.temperature_rate.filter(|_| moment.t_s > 1.6) {
            let now = (RATE_HZ * moment.t_s).round() as usize;
            let slopes = (now - 99..=now).map(|i| RATE_HZ * (mean(&run[i]) - mean(&run[i - 1])));
            let (low, high) = slopes.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
            assert!((low - 1e-4..=high + 1e-4).contains(&rate), "{} {rate} {low} {high}", moment.t_s);
        }
    }
    let at_3 = &run[299].percept;
    assert!((at_3.warmest.unwrap() - 34.0).abs() < 0.1 && (at_3.coldest.unwrap() - 21.0).abs() < 0.01);
}

#[test]
fn recordings_have_all_channels_and_the_truth_of_each_letter() {
    let folder = tempfile::tempdir().unwrap();
    let written = |kinds: usize, touch: &str| {
        let [frames, truth] = ["a.csv", "a.truth.csv"].map(|name| folder.path().join(name));
        let output = |path| OutputPath::new(path, true, &[]).unwrap();
        write_recording(&mut simulated(&skin(kinds), 0.1, "", touch), output(&frames), output(&truth)).unwrap();
        [frames, truth].map(|path| std::fs::read_to_string(path).unwrap())
    };
    let touch = "path = [[0, 0]]\nhold = { newton = 1 }\nfriction = 0.5\ncelsius = 30";
    let [frames, truth] = written(3, touch);
    let header: Vec<&str> = frames.lines().next().unwrap().split(',').collect();
    for name in ["0", "168.u", "84.v", "1000", "2168"] {
        assert!(header.contains(&name), "{name}");
    }
    assert!(
        truth
            .lines()
            .next()
            .unwrap()
            .ends_with(",depth,shear_x,shear_y,shear_z,shear_u,shear_v,torsion,slips,gap,celsius")
    );
    assert!(truth.lines().nth(1).unwrap().ends_with(",0,0,0,0,0,0,0,0,30"), "{truth}");
    let [frames, truth] = written(1, touch);
    assert!(!frames.lines().next().unwrap().contains("1000"));
    assert!(truth.lines().next().unwrap().ends_with(",depth,shear_x,shear_y,shear_z,shear_u,shear_v,torsion,slips"));
}

#[test]
fn counts_have_room_for_both_signs() {
    let sensor = "[sensor]\nkind = \"linear\"\ngain = 4000\noffset = 20\nbits = 12";
    let run = moments(simulated(&skin(1), 1.0, sensor, &drag(200.0, 0.02, 0.05, 0.6)), Receptor::Shear);
    let last = run.iter().rfind(|moment| moment.truth.as_ref().is_some_and(|truth| truth.slips == Some(true))).unwrap();
    let (truth, percept) = (last.truth.as_ref().unwrap(), &last.percept);
    let (right, found) = (truth.shear_uv.unwrap(), percept.shear.unwrap());
    assert!((right[0] - found[0]).hypot(right[1] - found[1]) < 0.02 * 2.4, "{right:?} {found:?}");
    assert!((percept.slip_ratio.unwrap() - 1.0).abs() < 0.02);
}

#[test]
fn what_makes_no_sense_is_said_with_its_line() {
    let body = skin(3);
    let why = |head: &str, touch: &str| {
        let text = format!(
            "rate_hz = 10\nduration_s = 1\n{head}\n[[touch]]\non = \"skin\"\nindenter = \"fingertip\"\npath = [[0, 0]]\n\
             hold = {{ newton = 1 }}\n{touch}\n"
        );
        SimulatedSource::on_body("a.toml", &text, body.clone()).map(|_| ()).unwrap_err().to_string()
    };
    let layer = "[layer]\nthickness_m = 0.005";
    assert!(why("", "friction = 0.5").starts_with("a.toml: line 9"), "{}", why("", "friction = 0.5"));
    assert!(why("", "friction = 0.5").contains("`friction` needs a layer that gives way"));
    assert!(why(layer, "friction = 0").contains("`friction` is 0; it must be over 0"));
    assert!(why(layer, "twist_deg = [[0, 0]]").contains("`twist_deg` has no effect without `friction`"));
    assert!(why(layer, "gap_m = [[0, -1]]").contains("`gap_m` is -1 at 0 s; give [t, metres], from 0 to 1000000"));
    assert!(why(layer, "gap_m = [[0, 1e7]]").ends_with("is 10000000 at 0 s; give [t, metres], from 0 to 1000000"));
    let twists = |list: &str| why(layer, &format!("friction = 1\ntwist_deg = {list}"));
    assert!(twists("[[0, 0, 0]]").ends_with("a list has 3 entries here; give it 2"), "{}", twists("[[0, 0, 0]]"));
    assert!(why(layer, "gap_m = [[0]]").ends_with("a list has 1 entry here; give it 2"));
    assert!(why(layer, "celsius = inf").contains("`celsius`"));
    assert!(why(layer, "celsius = -300").contains("`celsius` is -300; nothing is colder than -273.15 °C"));
    assert!(why("[temperature]\nambient_celsius = -500", "").contains("`ambient_celsius` is -500; nothing is colder"));
    assert!(why("[temperature]\ntime_constant_s = 0", "").contains("`time_constant_s` is 0; it must be over 0"));
    assert!(why("[sensor]\nkind = \"fsr\"", "").contains("`kind` is fsr, which feels only the normal force"));
    let off = why(
        layer,
        "gap_m = [[0, 0.1]]\n[[touch]]\non = \"skin\"\nindenter = \"fingertip\"\npath = [[1, 1]]\n\
                         hold = { newton = 0 }\ngap_m = [[0, 0.1]]",
    );
    assert!(off.contains("leaves the surface"), "{off}");
}
