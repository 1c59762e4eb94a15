//! Simulated touches: the same bytes always, forces that add up, truth that percepts find, one line for what is wrong.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use somatic::signal::FsrCircuit;
use somatic::source::{CsvSource, SimulatedSource, Source as _, SourceSpec, VendorOptions, write_recording};
use somatic::{BackendKind, Body, Calibration, Engine, Frame, Options, OutputPath, Percept};

use crate::common::{Flat, engine};

/// Distance between neighbours on the dense skin, m.
const PITCH: f64 = 4e-3;
/// Taxels from its middle to its edge.
const HALF: i32 = 17;
/// Spread of pressure under 7 mm, m.
const SIGMA: f64 = 7e-3 * 0.577_350_269_189_625_8;

/// A square of taxels without gaps, with one field `all`.
fn dense() -> Body {
    let uv: Vec<[f64; 2]> = (-HALF..=HALF)
        .flat_map(|row| (-HALF..=HALF).map(move |column| [f64::from(column) * PITCH, f64::from(row) * PITCH]))
        .collect();
    let count = uv.len() as u32;
    Flat::new(&uv).surface(0.08).field("all", None, 0..count).body()
}

/// A simulation of `touch` on the dense skin under 7 mm.
fn on_dense(sensor: &str, touch: &str) -> SimulatedSource {
    let text = format!(
        "rate_hz = 10\nduration_s = 1\nseed = 5\n[layer]\nthickness_m = 0.007\n\
         [sensor]\narea_m2 = 1.6e-5\n{sensor}\n[[touch]]\non = \"all\"\n{touch}\n"
    );
    SimulatedSource::on_body("dense", &text, dense()).unwrap()
}

fn first(simulation: &mut SimulatedSource) -> Frame {
    let mut frame = Frame::missing(0.0, simulation.taxels().len());
    assert!(simulation.next_frame(&mut frame).unwrap());
    frame
}

fn numbers(frame: &Frame) -> Vec<f64> {
    frame.values.iter().map(|value| value.number().unwrap()).collect()
}

/// The percept of the reference backend on the dense skin's one field.
fn percept(simulation: &mut SimulatedSource) -> Percept {
    let frame = first(simulation);
    let mut engine = engine(simulation.body(), BackendKind::Reference);
    engine.process(&[frame]).unwrap().get(0, 0)
}

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/simulations").join(name)
}

fn new(path: &Path) -> OutputPath {
    OutputPath::new(path, false, &[]).unwrap()
}

fn written(simulation: &mut SimulatedSource) -> (Vec<u8>, Vec<u8>) {
    let folder = tempfile::tempdir().unwrap();
    let (frames, truth) = (folder.path().join("a.csv"), folder.path().join("a.truth.csv"));
    write_recording(simulation, new(&frames), new(&truth)).unwrap();
    (std::fs::read(frames).unwrap(), std::fs::read(truth).unwrap())
}

/// Of bytes, as a number to compare machines by (FNV-1a).
fn fingerprint(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xCBF2_9CE4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3))
}

#[test]
fn the_same_file_gives_the_same_bytes() {
    for name in ["taps.toml", "rod.toml", "mat.toml"] {
        let mut simulation = SimulatedSource::open(example(name)).unwrap();
        let once = written(&mut simulation);
        assert_eq!(once, written(&mut simulation), "{name}: from the start again");
        assert_eq!(once, written(&mut SimulatedSource::open(example(name)).unwrap()), "{name}: opened again");
    }
    let text = std::fs::read_to_string(example("rod.toml")).unwrap();
    let reseeded = |seed: u32| {
        let text = text.replace("seed = 6", &format!("seed = {seed}"));
        written(&mut SimulatedSource::from_text("rod", &text, Path::new("")).unwrap())
    };
    assert_eq!(reseeded(6), reseeded(6));
    assert_ne!(reseeded(6).0, reseeded(7).0);
    assert_eq!(reseeded(6).1, reseeded(7).1, "noise leaves the truth alone");
}

#[test]
fn a_frame_does_not_depend_on_how_it_is_read() {
    let mut simulation = SimulatedSource::open(example("mat.toml")).unwrap();
    let mut frame = Frame::missing(0.0, simulation.taxels().len());
    let mut in_order = Vec::new();
    while simulation.next_frame(&mut frame).unwrap() {
        in_order.push((frame.clone(), simulation.truth().to_vec()));
    }
    assert_eq!(in_order.len() as u64, simulation.frames());
    assert_eq!(in_order.len(), 150);
    assert!(!simulation.next_frame(&mut frame).unwrap(), "the end stays the end");
    for k in 0..in_order.len() {
        let number = (k * 67) % in_order.len();
        simulation.seek(number as u64);
        assert!(simulation.next_frame(&mut frame).unwrap());
        assert_eq!((&frame, simulation.truth()), (&in_order[number].0, &in_order[number].1[..]));
    }
}

#[test]
fn a_recording_reads_back_as_the_source_delivers_it() {
    let folder = tempfile::tempdir().unwrap();
    let (frames, truth) = (folder.path().join("rod.csv"), folder.path().join("rod.truth.csv"));
    let mut simulation = SimulatedSource::open(example("rod.toml")).unwrap();
    assert_eq!(write_recording(&mut simulation, new(&frames), new(&truth)).unwrap(), 200);
    let mut read = CsvSource::open(&frames, None).unwrap();
    let spec: SourceSpec = format!("sim:{}", example("rod.toml").display()).parse().unwrap();
    let mut direct = spec.open(read.taxels(), &VendorOptions::default()).unwrap();
    assert_eq!(read.taxels(), direct.taxels());
    let (mut a, mut b) = (Frame::missing(0.0, 40), Frame::missing(0.0, 40));
    while direct.next_frame(&mut b).unwrap() {
        assert!(read.next_frame(&mut a).unwrap());
        assert_eq!(a, b);
    }
    assert!(!read.next_frame(&mut a).unwrap());

    let truth = std::fs::read_to_string(truth).unwrap();
    let mut rows = truth.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = rows.next().unwrap();
    let column = |name: &str| header.iter().position(|&head| head == name).unwrap();
    let rows: Vec<_> = rows.collect();
    let number = |row: &[&str], name: &str| row[column(name)].parse::<f64>().unwrap();
    // The rod is down after 0.5 s and until 3.5 s, and crosses 30 mm in that time.
    assert_eq!(rows.len(), 149);
    assert_eq!(rows[0][column("vv")], "", "no velocity without a frame before");
    for row in &rows[1..] {
        assert!((number(row, "vv") + 0.01).abs() < 1e-12);
        assert!((number(row, "v") - (0.015 - 0.01 * (number(row, "t") - 0.5))).abs() < 1e-12);
        assert!((0.0..PI).contains(&number(row, "angle")));
    }

    // Somebody else's file that comes up in the truth's place is found out last.
    let (fresh, taken) = (folder.path().join("fresh.csv"), folder.path().join("taken.csv"));
    let (to_fresh, to_taken) = (new(&fresh), new(&taken));
    std::fs::write(&taken, "mine").unwrap();
    assert!(write_recording(&mut simulation, to_fresh, to_taken).is_err());
    assert!(!fresh.exists(), "both files or none");
    assert_eq!(std::fs::read_to_string(&taken).unwrap(), "mine");
}

/// What sampling a footprint with spread σ at the pitch p may miss of its sum, and of its first and second moments over
/// σ and σ²: by Poisson's summation formula the footprint's transform at the lattice's other frequencies k/p, each at
/// most exp(−2π²σ²k²/p²), once with the first and second powers of 2πσk/p that derivatives bring down.
fn aliasing(sigma: f64, pitch: f64) -> f64 {
    let ratio = 2.0 * PI * sigma / pitch;
    let terms = (-6..=6_i32).flat_map(|i| (-6..=6_i32).map(move |j| f64::from(i * i + j * j))).filter(|&k| k > 0.0);
    terms.map(|squared| (-0.5 * ratio * ratio * squared).exp() * (1.0 + ratio * squared.sqrt()).powi(2)).sum()
}

/// Single precision, in which raw values travel and taxels' places are stored.
const U: f64 = 1.0 / 16_777_216.0;

const TOUCHES: [&str; 5] = [
    "indenter = \"ball\"\nradius_m = 0.01",
    "indenter = \"fingertip\"",
    "indenter = \"flat\"\nradius_m = 0.015",
    "indenter = \"rod\"\nradius_m = 0.0127\nlength_m = 0.04\nangle_deg = 33",
    "indenter = \"edge\"\nlength_m = 0.03\nangle_deg = 121",
];

#[test]
fn all_of_the_force_arrives_on_a_flat_skin() {
    for touch in TOUCHES {
        for (u, v) in [(0.0, 0.0), (0.0013, -0.0007), (0.002, 0.002)] {
            let mut simulation = on_dense("", &format!("{touch}\npath = [[{u}, {v}]]\nhold = {{ newton = 7.5 }}"));
            let sum: f64 = numbers(&first(&mut simulation)).iter().sum();
            // Each value is rounded once; the footprint's tails beyond the skin's edge, over 6σ away, are below 10⁻⁸.
            let bound = 7.5 * (aliasing(SIGMA, PITCH) + U + 1e-8);
            assert!((sum - 7.5).abs() <= bound, "{touch} at ({u}, {v}): {sum} N, bound {bound:e}");
            assert_eq!(simulation.truth()[0].force_newton, 7.5);
        }
    }
    assert!(aliasing(SIGMA, PITCH) < 1e-6 && aliasing(SIGMA, 2.5 * PITCH) > 0.1, "the bound knows a coarse skin");
}

/// The dense skin under another `layer`.
fn under(layer: &str, touch: &str) -> SimulatedSource {
    let text = format!(
        "rate_hz = 10\nduration_s = 1\n[layer]\nthickness_m = 0.007\n{layer}\n[sensor]\narea_m2 = 1.6e-5\n\
         [[touch]]\non = \"all\"\n{touch}\npath = [[0.0013, -0.0007]]\nhold = {{ newton = 7.5 }}\n"
    );
    SimulatedSource::on_body("dense", &text, dense()).unwrap()
}

#[test]
fn another_layer_changes_what_is_felt_and_not_the_truth() {
    for touch in TOUCHES {
        let mut plain = under("", touch);
        let felt = numbers(&first(&mut plain));
        // What lies beyond the skin's edge, from the touch's own end: nothing of a Gaussian, z³/r³ at most of Boussinesq's.
        let edge = (f64::from(HALF) + 0.5) * PITCH - 0.022;
        for (layer, tail) in [("contact = \"hertz\"", 0.0), ("kernel = \"boussinesq\"", (7e-3_f64 / edge).powi(3))] {
            let mut other = under(layer, touch);
            let values = numbers(&first(&mut other));
            let sum: f64 = values.iter().sum();
            assert!((sum - 7.5).abs() <= 7.5 * (tail + aliasing(SIGMA, PITCH) + U + 1e-8), "{touch}, {layer}: {sum} N");
            assert!(tail == 0.0 || sum < 7.5 * (1.0 - 1e-4), "{touch}: the tail is not there: {sum} N");
            let apart = values.iter().zip(&felt).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // An edge has no width, and a disc's is exact in either.
            let is_exact = layer.starts_with("contact") && (touch.contains("edge") || touch.contains("flat"));
            assert!(is_exact != (apart > 1e-4 * 7.5 / 100.0), "{touch}, {layer}: {apart:e} N");
            let [mine, its] = [&plain, &other].map(|simulation| simulation.truth().to_vec());
            assert_eq!(mine, its, "the truth is the indenter's");
        }
    }
}

#[test]
fn gains_and_thresholds_differ_from_the_calibration() {
    let touch = "indenter = \"ball\"\nradius_m = 0.01\npath = [[0, 0]]\nhold = { newton = 20 }";
    let mut plain = on_dense("", touch);
    let even = numbers(&first(&mut plain));
    let mut spread = on_dense("gain_spread = 0.2", touch);
    let uneven = numbers(&first(&mut spread));
    assert!(plain.gains().iter().all(|&gain| gain == 1.0));
    for ((even, uneven), gain) in even.iter().zip(&uneven).zip(spread.gains()) {
        assert!((uneven - even * gain).abs() <= 2.0 * U * uneven.abs(), "{even} {uneven} {gain}");
    }
    // Logarithms of the gains, to five standard deviations of each estimate.
    let n = spread.gains().len() as f64;
    let logs: Vec<f64> = spread.gains().iter().map(|gain| gain.ln()).collect();
    let mean = logs.iter().sum::<f64>() / n;
    let variance = logs.iter().map(|log| log * log).sum::<f64>() / n;
    assert!(mean.abs() < 5.0 * 0.2 / n.sqrt() && (variance / 0.04 - 1.0).abs() < 5.0 * (2.0 / n).sqrt());
    let gains = |sensor: &str| on_dense(sensor, touch).gains().to_vec();
    assert_eq!(gains("gain_spread = 0.2\nnoise_sigma = 3"), spread.gains());
    assert_ne!(gains("gain_spread = 0.2\ngain_seed = 1"), spread.gains());
    assert_eq!(spread.truth(), plain.truth());
    assert_eq!(spread.calibration(), plain.calibration(), "the calibration knows nothing of it");

    let hidden = numbers(&first(&mut on_dense("threshold_newton = 0.1", touch)));
    for (even, hidden) in even.iter().zip(&hidden) {
        assert_eq!(*hidden, if *even > 0.1 { *even } else { 0.0 });
    }
    assert!(hidden.contains(&0.0) && hidden.iter().any(|&value| value > 0.1));
    let text = format!("{SOUND}[calibration]\ndead_band = 4.5\n");
    let other = SimulatedSource::from_text("a.toml", &text, Path::new("")).unwrap().calibration();
    assert_eq!(other.matches("dead_band").count(), 1);
    assert!(other.contains("dead_band = 4.5\n"), "{other}");
}

#[test]
fn what_the_layers_tails_leave_without_noise_is_no_touch() {
    let touch = "indenter = \"ball\"\nradius_m = 0.01\npath = [[0, 0]]\nhold = { newton = 4 }";
    let mut simulation = on_dense("", touch);
    let frame = first(&mut simulation);
    let forces = numbers(&frame);
    let over = |least: f64| forces.iter().filter(|force| **force > least).count() as u32;
    assert!(over(1e-6) > 50 && over(0.0) > over(1e-6) + 50, "{} {}", over(0.0), over(1e-6));
    let active = |simulation: &SimulatedSource| {
        let calibration = Calibration::parse(&simulation.calibration(), simulation.taxels()).unwrap();
        let options = Options::default().calibration(Some(calibration)).backend(BackendKind::Reference);
        let mut engine = Engine::new(simulation.body(), options).unwrap();
        engine.process_one(&frame).unwrap().get(0, 0).active.unwrap()
    };
    assert_eq!(active(&simulation), over(1e-6));
    for (sensor, dead_band) in [
        ("kind = \"linear\"\noffset = 500\ngain = 20", "dead_band = 0.000001\n"),
        ("kind = \"linear\"\noffset = 500\ngain = 20\nbits = 10", "dead_band = 0.025\n"),
        ("noise_sigma = 0.5", "dead_band = 3\n"),
    ] {
        let calibration = on_dense(sensor, touch).calibration();
        assert!(calibration.contains(dead_band), "{sensor}: {calibration}");
    }
}

#[test]
fn the_calibrations_noise_is_that_of_raw_values() {
    let touch = "indenter = \"ball\"\nradius_m = 0.01\npath = [[0, 0]]\nhold = { newton = 0 }";
    for sensor in [
        "noise_sigma = 0.02",
        "kind = \"linear\"\noffset = 500.3\ngain = 20\nnoise_sigma = 3",
        "kind = \"linear\"\noffset = 500.3\ngain = 20\nbits = 10\nnoise_sigma = 0.6",
    ] {
        let mut simulation = on_dense(sensor, touch);
        let calibration = Calibration::parse(&simulation.calibration(), simulation.taxels()).unwrap();
        let noise = calibration.taxels[0].noise.unwrap();
        let mut frame = Frame::missing(0.0, simulation.taxels().len());
        let (mut values, mut squares, mut count) = (0.0, 0.0, 0.0);
        while simulation.next_frame(&mut frame).unwrap() {
            for value in numbers(&frame) {
                (values, squares, count) = (values + value, squares + value * value, count + 1.0);
            }
        }
        let sigma = (squares / count - (values / count) * (values / count)).sqrt();
        // Five standard deviations of the estimate.
        assert!((sigma / noise - 1.0).abs() < 5.0 / (2.0_f64 * count).sqrt(), "{sensor}: {sigma} {noise}");
    }
    let unknown = on_dense("kind = \"fsr\"\noutput = \"linearised\"\nnoise_sigma = 2", touch).calibration();
    assert!(!unknown.contains("noise"), "it depends on the force: {unknown}");
}

#[test]
fn the_centroid_of_a_symmetrical_touch_is_its_truth() {
    for touch in TOUCHES {
        for (u, v) in [(0.0, 0.0), (0.0011, -0.0007)] {
            let mut simulation = on_dense("", &format!("{touch}\npath = [[{u}, {v}]]\nhold = {{ newton = 2 }}"));
            let [got_u, got_v] = percept(&mut simulation).centroid.unwrap();
            let [true_u, true_v] = simulation.truth()[0].uv.unwrap();
            assert_eq!([true_u, true_v], [u, v]);
            // Sampling, then places rounded to single precision (and values: each moves the mean by its distance).
            let reach = f64::from(HALF) * PITCH * 1.5;
            let bound = aliasing(SIGMA, PITCH) * SIGMA + 3.0 * U * reach;
            let off = (got_u - true_u).hypot(got_v - true_v);
            assert!(off <= bound, "{touch} at ({u}, {v}): off by {off:e} m, bound {bound:e}");
        }
    }
}

#[test]
fn the_principal_axis_of_a_rod_is_its_truth() {
    let length = 0.05_f64;
    // What tells the directions apart: the variance of an even line of this length, less that of the contact's width,
    // which at 2 N is b²/4 = (F/L)R/πE*.
    let apart = length * length / 12.0 - 2.0 / length * 0.0127 / (PI * 400e3);
    for angle in (0..180).step_by(5) {
        let mut simulation = on_dense(
            "",
            &format!(
                "indenter = \"rod\"\nradius_m = 0.0127\nlength_m = {length}\nangle_deg = {angle}\n\
                 path = [[0.0004, 0.0009]]\nhold = {{ newton = 2 }}"
            ),
        );
        let got = percept(&mut simulation).principal_axis.unwrap();
        let truth = simulation.truth()[0].angle.unwrap();
        assert!((truth - f64::from(angle).to_radians()).abs() < 1e-15);
        // Second moments off by `error` turn the axis by at most asin(2 · error / apart) / 2. Beside sampling and
        // rounding there are the tails beyond the skin's edge: from the rod's end it is at least 40 mm − 1 mm, 9σ away.
        let reach = f64::from(HALF) * PITCH * 1.5;
        let error = aliasing(SIGMA, PITCH) * SIGMA * SIGMA + 4.0 * U * reach * reach;
        let bound = (2.0 * error / apart).asin();
        let off = (got - truth).abs().min(PI - (got - truth).abs());
        assert!(off <= bound, "{angle}°: off by {off:e} rad, bound {bound:e}");
        assert!(bound < 1e-3, "{bound}");
    }
}

#[test]
fn dead_stuck_and_noisy_taxels_behave() {
    let middle = 2 * HALF * (HALF + 1);
    let sensor = format!(
        "kind = \"fsr\"\nwiper = 38\nnoise_sigma = 2\ndead = [{middle}]\nstuck = [{{ taxel = {}, at = 321 }}]\n\
         noisy = [{{ taxel = {}, sigma = 80 }}]",
        middle + 1,
        middle + 2
    );
    let touch = "indenter = \"fingertip\"\npath = [[0, 0]]\nhold = { newton = 9 }";
    let mut simulation = on_dense(&sensor, touch);
    let mut frame = Frame::missing(0.0, simulation.taxels().len());
    let mut columns = vec![Vec::new(); 4];
    while simulation.next_frame(&mut frame).unwrap() {
        let values = numbers(&frame);
        for (column, offset) in columns.iter_mut().zip([0, 1, 2, -1]) {
            column.push(values[(middle + offset) as usize]);
        }
    }
    let open = f64::from(FsrCircuit::OPEN_COUNTS);
    assert!(columns[0].iter().all(|&v| v == open), "dead: as if untouched, whatever presses");
    assert!(columns[1].iter().all(|&v| v == 321.0));
    let spread = |values: &[f64]| {
        values.iter().copied().fold(f64::MIN, f64::max) - values.iter().copied().fold(f64::MAX, f64::min)
    };
    assert!(spread(&columns[2]) > 60.0 && (1.0..20.0).contains(&spread(&columns[3])));
    assert!(simulation.forces_newton()[middle as usize] > 0.3, "the force is there all the same");
    // Pressed, the healthy neighbour reads lower than open: the divider turns the signal round.
    assert!(columns[3].iter().all(|&v| v < open - 100.0));
}

/// What a simulation's sensors feel under `calibration`: the total of each frame, 0 where there is no contact.
fn totals(simulation: &mut SimulatedSource, calibration: &str) -> Vec<f64> {
    let calibration = Some(Calibration::parse(calibration, simulation.taxels()).unwrap());
    let options = Options::default().calibration(calibration).backend(BackendKind::Reference);
    let mut engine = Engine::new(simulation.body(), options).unwrap();
    engine.set_channels(simulation.taxels()).unwrap();
    let mut frame = Frame::missing(0.0, simulation.taxels().len());
    let mut totals = Vec::new();
    while simulation.next_frame(&mut frame).unwrap() {
        let percept = engine.process(std::slice::from_ref(&frame)).unwrap().get(0, 0);
        totals.push(percept.total.filter(|_| percept.contact).unwrap_or(0.0));
    }
    totals
}

const PRESS_AFTER_HALF: &str = "indenter = \"ball\"\nradius_m = 0.01\npath = [[0, 0]]\n\
                                press = { from_s = 0.5, to_s = 1.5, newton = 40, ramp_s = 0.1 }";

#[test]
fn by_its_own_calibration_a_simulation_feels_its_force_and_nothing_at_rest() {
    let fsr = |counts: u16| FsrCircuit { wiper: 50 }.linearised(counts, FsrCircuit::SATURATION_NEWTON);
    let as_it_is: fn(f64) -> f64 = |newton| newton;
    let signals: [(&str, &dyn Fn(f64) -> f64); 6] = [
        ("kind = \"ideal\"", &as_it_is),
        ("kind = \"linear\"\noffset = 30.5\ngain = 20", &as_it_is),
        ("kind = \"linear\"\noffset = 240\ngain = 25\ninvert = true", &as_it_is),
        ("kind = \"fsr\"\nwiper = 50", &|newton| fsr(FsrCircuit { wiper: 50 }.counts(newton))),
        ("kind = \"fsr\"\nwiper = 50\noutput = \"linearised\"", &|newton| fsr(FsrCircuit { wiper: 50 }.counts(newton))),
        ("kind = \"fsr\"\nwiper = 50\noutput = \"logarithmic\"", &|newton| {
            let circuit = FsrCircuit { wiper: 50 };
            circuit.logarithmic(circuit.counts(newton))
        }),
    ];
    for (sensor, signal) in signals {
        let mut simulation = on_dense(sensor, PRESS_AFTER_HALF);
        let calibration = simulation.calibration();
        let felt = totals(&mut simulation, &calibration);
        assert!(felt[..5].iter().all(|&total| total == 0.0), "{sensor}: {felt:?}");
        // The frame read last, in which all of the force is there. Raw values are in single precision, off by half a unit
        // in the last place of 240 + 25 · newton each.
        let right: f64 = simulation.forces_newton().iter().map(|&newton| signal(newton)).sum();
        assert!(
            right > 39.0 && (felt[9] - right).abs() <= 1225.0 * 4096.0 * U / 25.0 + right * 4.0 * U,
            "{sensor}: {felt:?}"
        );
    }
    // Noise, rounding and what is broken are no touch; without the calibration they are.
    for sensor in [
        "kind = \"ideal\"\nnoise_sigma = 0.05",
        "kind = \"linear\"\noffset = 30.4\ngain = 20\nbits = 12\nnoise_sigma = 2",
        "kind = \"linear\"\noffset = 240\ngain = 20\nbits = 8\ninvert = true\nnoise_sigma = 0.5",
        "kind = \"fsr\"\nnoise_sigma = 1.5\nstuck = [{ taxel = 3, at = 700 }]\nnoisy = [{ taxel = 25, sigma = 80 }]",
        "kind = \"fsr\"\nnoise_sigma = 40",
        "kind = \"fsr\"\nnoise_sigma = 1.5\noutput = \"logarithmic\"",
    ] {
        let calibration = on_dense(sensor, PRESS_AFTER_HALF).calibration();
        let felt = totals(&mut on_dense(sensor, PRESS_AFTER_HALF), &calibration);
        assert!(felt[..5].iter().all(|&total| total == 0.0) && felt[9] > 0.0, "{sensor}: {felt:?}");
        let raw = totals(&mut on_dense(sensor, PRESS_AFTER_HALF), "");
        assert!(raw[..5].iter().all(|&total| total > 0.0), "{sensor}: {raw:?}");
    }
}

#[test]
fn the_papers_rod_lights_row_after_row_of_the_back_board() {
    let mut simulation = SimulatedSource::open(example("rod.toml")).unwrap();
    let ids = simulation.taxels().to_vec();
    let mut frame = Frame::missing(0.0, ids.len());
    let mut lowest = vec![(f64::MAX, 0.0); ids.len()];
    while simulation.next_frame(&mut frame).unwrap() {
        for (lowest, value) in lowest.iter_mut().zip(numbers(&frame)) {
            if value < lowest.0 {
                *lowest = (value, frame.t_s);
            }
        }
    }
    for (id, (value, t_s)) in ids.iter().zip(&lowest) {
        if (16..25).contains(id) {
            assert!(*value < 700.0, "taxel {id} under the rod reads {value}");
            let row = f64::from((id - 16) / 3);
            assert!((t_s - (0.9 + 1.1 * row)).abs() < 0.5, "taxel {id} is pressed most at {t_s} s");
        } else {
            assert!(*value > 1000.0, "taxel {id} elsewhere reads {value}");
        }
    }
}

#[test]
fn only_what_faces_the_touch_feels_it() {
    let text = "body = \"hand\"\nrate_hz = 1\nduration_s = 1\n[[touch]]\non = \"hand\"\nindenter = \"ball\"\n\
                radius_m = 0.01\npath = [[0, 0.0055, 0]]\nhold = { newton = 5 }\n[layer]\nthickness_m = 0.02\n";
    let mut simulation = SimulatedSource::from_text("ball", text, Path::new("")).unwrap();
    first(&mut simulation);
    let truth = &simulation.truth()[0];
    assert!(truth.uv.is_none() && truth.angle.is_none());
    assert!((truth.normal_in_link.y - 1.0).abs() < 1e-5);
    let felt = |id: u32| simulation.forces_newton()[simulation.taxels().iter().position(|&t| t == id).unwrap()];
    assert!((16..25).all(|id| felt(id) > 0.0), "the back of the hand");
    assert!((0..9).all(|id| felt(id) == 0.0), "the palm behind it");
    assert!(felt(20) > felt(16));
}

#[test]
fn a_fingertip_on_a_skinned_body_is_found_where_it_is() {
    let humanoid = Body::from_bytes("humanoid", somatic::bundled::HUMANOID).unwrap();
    let mut engine = engine(&humanoid, BackendKind::Reference);
    let mut tried = 0;
    // Some of each limb's patches: opening each takes its time.
    for (index, spec) in humanoid.fields.iter().enumerate().step_by(8) {
        let text = format!(
            "rate_hz = 1\nduration_s = 1\n[layer]\nthickness_m = 0.02\n[[touch]]\non = \"{}\"\nindenter = \"fingertip\"\n\
             path = [[0, 0]]\nhold = {{ newton = 3 }}\n",
            spec.name
        );
        let mut simulation = match SimulatedSource::on_body("humanoid", &text, humanoid.clone()) {
            Ok(simulation) => simulation,
            Err(e) => {
                assert!(e.to_string().contains("has no chart"), "{e}");
                continue;
            }
        };
        let frame = first(&mut simulation);
        let truth = &simulation.truth()[0];
        let percept = engine.process(&[frame]).unwrap().get(0, index);
        let [u, v] = percept.centroid.unwrap();
        let [true_u, true_v] = truth.uv.unwrap();
        // Patches end around the touch and taxels lie 20 mm apart: half of that is what one can ask for.
        let off = (u - true_u).hypot(v - true_v);
        assert!(off < 0.01, "{}: off by {off} m", spec.name);
        tried += 1;
    }
    assert!(tried > 8, "{tried} patches");
}

/// A sound simulation, for tests to break.
const SOUND: &str = r#"body = "hand"
rate_hz = 50
duration_s = 2
[layer]
thickness_m = 0.007
[sensor]
kind = "fsr"
wiper = 38
dead = [17]
[[touch]]
on = "hand/back"
indenter = "rod"
radius_m = 0.0127
length_m = 0.05
path = [[0, 0.01],
  [0, -0.01]]
times_s = [0, 2]
angle_deg = 20
force_newton = [[0, 10], [2, 10]]
"#;

/// `message` without its column.
fn without_column(message: &str) -> String {
    let (before, after) = message.split_once(", column ").unwrap_or((message, ""));
    format!("{before}{}", after.trim_start_matches(|c: char| c.is_ascii_digit()))
}

#[test]
fn what_is_wrong_is_reported_in_one_line() {
    assert!(SimulatedSource::from_text("a.toml", SOUND, Path::new("")).is_ok());
    let why = |from: &str, to: &str| {
        assert!(SOUND.contains(from), "{from}");
        let text = SOUND.replacen(from, to, 1);
        let error = SimulatedSource::from_text("a.toml", &text, Path::new("")).err();
        let line = error.unwrap_or_else(|| panic!("`{to}` should be refused")).to_string();
        assert!(!line.contains('\n'));
        without_column(&line)
    };
    let cases = [
        ("rate_hz = 50", "rate_hz = 0", "a.toml: line 2: `rate_hz` is 0; it must be over 0"),
        ("rate_hz = 50", "rate_hz = nan", "a.toml: line 2: `rate_hz` is NaN"),
        ("rate_hz = 50", "rate_hz = \"fast\"", "a.toml: line 2: invalid type"),
        ("rate_hz = 50\n", "", "`rate_hz` is missing"),
        ("rate_hz = 50", "rate = 50", "a.toml: line 2: there is no key `rate`; did you mean `rate_hz`?"),
        ("duration_s = 2", "duration_s = -1", "a.toml: line 3: `duration_s` is -1; it must be over 0"),
        ("duration_s = 2", "duration_s = 1e9", "a.toml: line 3: `duration_s` and `rate_hz` make"),
        ("body = \"hand\"", "body = \"hnd\"", "a.toml: line 1: there is no body `hnd`; did you mean `hand`?"),
        ("body = \"hand\"\n", "", "`body` is missing"),
        ("thickness_m = 0.007", "thickness_m = -1", "a.toml: line 5: `thickness_m` is -1; it must be 0 or more"),
        ("thickness_m = 0.007", "thickness_m = 1\nstiffness_pa = 0", "a.toml: line 6: `stiffness_pa` is 0"),
        ("0.007", "0.007\nkernel = \"flat\"", "a.toml: line 6: there is no choice `flat`"),
        ("0.007", "0\nkernel = \"boussinesq\"", "a.toml: line 5: `thickness_m` is 0; it must be over 0"),
        ("0.007", "0\ncontact = \"hertz\"", "a.toml: line 5: `thickness_m` is 0; it must be over 0"),
        (
            "0.007",
            "0.007\nkernel = \"boussinesq\"\nspread = 0.5",
            "a.toml: line 7: `spread` has no effect with `kernel = \"boussinesq\"`",
        ),
        (
            "0.007",
            "0.007\nkernel = \"boussinesq\"\ncontact = \"gaussian\"",
            "a.toml: line 7: `contact` is gaussian; with `kernel = \"boussinesq\"` it must be hertz",
        ),
        ("wiper = 38", "gain_spread = -0.1", "a.toml: line 8: `gain_spread` is -0.1; it must be 0 or more"),
        ("wiper = 38", "threshold_newton = -1", "a.toml: line 8: `threshold_newton` is -1; it must be 0 or more"),
        ("[sensor]", "[calibration]\ndead_band = -1\n[sensor]", "a.toml: line 7: `dead_band` is -1; it must be 0"),
        ("kind = \"fsr\"", "kind = \"fsrr\"", "a.toml: line 7: there is no choice `fsrr`; did you mean `fsr`?"),
        ("wiper = 38", "wiper = 256", "a.toml: line 8: `wiper` is 256; it must be between 0 and 255"),
        ("wiper = 38", "gain = 2", "a.toml: line 8: `gain` has no effect for this kind of sensor"),
        ("wiper = 38", "noise_sigma = -2", "a.toml: line 8: `noise_sigma` is -2"),
        ("dead = [17]", "dead = [30]", "a.toml: line 9: the body has no pressure taxel 30"),
        ("dead = [17]", "dead = [17, 17]", "a.toml: line 9: taxel 17 is broken twice"),
        ("dead = [17]", "stuck = [{ taxel = 1, at = inf }]", "a.toml: line 9: `at` is inf"),
        ("hand/back", "hand/bakc", "a.toml: line 11: there is no field `hand/bakc`; did you mean `hand/back`?"),
        ("hand/back", "thumb", "a.toml: line 11: `thumb` is a link, not a field; give its `path` as [x, y, z]"),
        ("hand/back", "hand", "a.toml: line 11: field `hand` has no chart"),
        ("\"rod\"", "\"rid\"", "a.toml: line 12: there is no choice `rid`; did you mean `rod`?"),
        ("\"rod\"", "\"ball\"", "`length_m` has no effect for this indenter"),
        ("radius_m = 0.0127", "radius_m = 0", "a.toml: line 13: `radius_m` is 0; it must be over 0"),
        ("radius_m = 0.0127", "radius_m = nan", "a.toml: line 13: `radius_m` is NaN"),
        ("radius_m = 0.0127\n", "", "a.toml: line 12: this indenter needs its `radius_m`"),
        ("length_m = 0.05", "length_m = -0.05", "a.toml: line 14: `length_m` is -0.05"),
        ("[0, -0.01]]", "[0, -0.01, 0]]", "a.toml: line 16: `path` is all [u, v] on a field, or all [x, y, z]"),
        ("[0, -0.01]]", "[0, nan]]", "a.toml: line 16: `path` has the coordinate NaN"),
        ("[0, 0.01],\n  [0, -0.01]", "", "`path` is empty"),
        (
            "times_s = [0, 2]",
            "times_s = [2, 2]",
            "a.toml: line 17: `times_s` has the time 2 after 2; times must increase",
        ),
        ("times_s = [0, 2]", "times_s = [-1, 2]", "a.toml: line 17: `times_s` has the time -1"),
        ("times_s = [0, 2]", "times_s = [0]", "a.toml: line 17: `times_s` has 1 times for 2 places"),
        ("times_s = [0, 2]\n", "", "a.toml: line 15: `path` has several places; give `times_s` or `speed_m_s`"),
        ("times_s = [0, 2]", "speed_m_s = 0", "a.toml: line 17: `speed_m_s` is 0"),
        ("times_s = [0, 2]", "times_s = [0, 2]\nspeed_m_s = 1", "`speed_m_s` has no effect with `times_s`"),
        ("angle_deg = 20", "angle_deg = inf", "a.toml: line 18: `angle_deg` is inf"),
        ("angle_deg = 20", "angle_deg = [[1, 2], [0, 3]]", "a.toml: line 18: `angle_deg` has the time 0 after 1"),
        ("angle_deg = 20", "angle_deg = \"up\"", "a.toml: line 18: `angle_deg` is a number of degrees, or a list"),
        ("[2, 10]]", "[2, -3]]", "a.toml: line 19: `force_newton` is -3 at 2 s; it must be 0 or more"),
        ("[2, 10]]", "[0, 10]]", "a.toml: line 19: `force_newton` has the time 0 after 0; times must increase"),
        ("[[0, 10], [2, 10]]", "[]", "a.toml: line 19: `force_newton` is empty"),
        ("[2, 10]]", "[2, 10]]\nhold = { newton = 3 }", "one of `force_newton`, `tap`, `press` and `hold`"),
        ("force_newton = [[0, 10], [2, 10]]", "", "a touch needs one of `force_newton`"),
        (
            "force_newton = [[0, 10], [2, 10]]",
            "tap = { at_s = [0, 0.1], newton = 1, lasts_s = 0.3 }",
            "a.toml: line 19: `at_s` has taps that overlap",
        ),
        (
            "force_newton = [[0, 10], [2, 10]]",
            "press = { from_s = 0, to_s = 0.1, newton = 1, ramp_s = 0.3 }",
            "a.toml: line 19: `to_s` comes before",
        ),
    ];
    for (from, to, expected) in cases {
        let line = why(from, to);
        assert!(line.contains(expected), "`{to}`:\n  {line}\nhas no\n  {expected}");
    }
}

#[test]
fn a_path_that_leaves_the_surface_says_when() {
    let text = SOUND.replace("[0, -0.01]]", "[0.08, 0.01]]");
    let open = |text: &str| SimulatedSource::from_text("a.toml", text, Path::new(""));
    let line = open(&text).err().unwrap().to_string();
    let at = line.strip_prefix("a.toml: line 15, column 8: `path` leaves the surface at ").expect(&line);
    let t_s: f64 = at.split(' ').next().unwrap().parse().unwrap();
    // The palm ends 24 mm from its middle, of 80 mm in 2 s.
    assert!((0.58..0.64).contains(&t_s), "{line}");
    let lifted = text.replace("[[0, 10], [2, 10]]", "[[0, 10], [0.5, 0]]");
    assert!(open(&lifted).is_ok(), "where nothing presses nothing can leave");
    let afar = "body = \"hand\"\nrate_hz = 1\nduration_s = 9\n[[touch]]\non = \"hand\"\nindenter = \"fingertip\"\n\
                path = [[0, 0.02, 0], [0, 0.1, 0]]\ntimes_s = [0, 8]\nhold = { newton = 1 }\n";
    let line = open(afar).err().unwrap().to_string();
    assert!(line.contains("line 7, column 8: `path` leaves the surface at 0.5"), "{line}");
}

#[test]
fn a_body_named_in_the_file_is_found_from_the_files_folder() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("my.glb"), somatic::bundled::HAND).unwrap();
    let text = SOUND.replace("\"hand\"", "\"my.glb\"");
    let path = folder.path().join("a.toml");
    std::fs::write(&path, &text).unwrap();
    assert_eq!(SimulatedSource::open(&path).unwrap().frames(), 100);
    std::fs::write(folder.path().join("my.glb"), b"no glb").unwrap();
    let line = SimulatedSource::open(&path).err().unwrap().to_string();
    assert!(line.contains("a.toml: line 1, column 8: ") && line.contains("my.glb"), "{line}");
    for name in somatic::bundled::BODIES {
        let text = format!("body = \"{name}\"\nrate_hz = 10\nduration_s = 1\n");
        assert_eq!(SimulatedSource::from_text("a.toml", &text, folder.path()).unwrap().body().name, name);
    }
    assert!(SimulatedSource::open(folder.path().join("b.toml")).err().unwrap().kind() == somatic::ErrorKind::NotFound);
}

#[test]
fn the_documentations_own_file_is_sound() {
    let text = include_str!("../../docs/reference/simulation.md");
    let example = text.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let mut simulation = SimulatedSource::from_text("docs", example, Path::new("")).unwrap();
    assert_eq!(simulation.frames(), 200);
    simulation.seek(75);
    first(&mut simulation);
    let touches: Vec<&str> = simulation.truth().iter().map(|truth| truth.name.as_str()).collect();
    assert_eq!(touches, ["rod", "touch 2"]);
    assert!((simulation.truth()[1].speed.unwrap() - 0.02).abs() < 1e-6);
}

#[test]
fn the_bytes_are_the_same_on_every_machine() {
    let (frames, truth) = written(&mut SimulatedSource::open(example("rod.toml")).unwrap());
    let found = [fingerprint(&frames), fingerprint(&truth)];
    // Change these only with the model, the example or the hand itself; never because one machine disagrees.
    assert_eq!(found, [0xB95A_3D5F_001F_200B, 0x8662_146D_F111_EB92], "{found:#018x?}");
}
