//! The makers' own totals, in their own files: each must come out, to the last digit that is printed.

use std::collections::BTreeMap;
use std::path::PathBuf;

use somatic::source::{Source as _, VendorOptions, VendorSource};
use somatic::{BackendKind, Body, Calibration, Engine, Frame, Options, Outputs, Percept, Scene};

use crate::common::data;
use crate::read;

/// Fields' percepts by name, frame by frame.
type Percepts = Vec<(f64, BTreeMap<String, Percept>)>;

fn recording(name: &str) -> Option<PathBuf> {
    data("recordings/vendor").map(|folder| folder.join(name))
}

/// What the engine makes of a recording, with its own body and calibration.
fn percepts(path: &PathBuf, backend: BackendKind) -> Percepts {
    let mut source = VendorSource::open(path, &VendorOptions::default()).unwrap();
    let body = Body::from_bytes(&source.body_name(), &source.body().unwrap()).unwrap();
    assert!(body.findings.is_empty(), "{:?}", body.findings);
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    assert_eq!(ids, source.taxels());
    let calibration = source.calibration().map(|text| Calibration::parse(&text, &ids).unwrap());
    let scene = Scene::default().outputs(Outputs::USUAL_AND_MOTION | Outputs::FORCE);
    let options = Options::default().scene(scene).calibration(calibration).backend(backend);
    let mut engine = Engine::new(&body, options).unwrap();
    engine.set_channels(source.taxels()).unwrap();
    let names: Vec<String> = engine.plan().fields().map(|field| field.name.to_owned()).collect();
    let mut frame = Frame::missing(0.0, ids.len());
    let mut all = Vec::new();
    while source.next_frame(&mut frame).unwrap() {
        let percepts = engine.process_one(&frame).unwrap();
        all.push((frame.t_s, names.iter().cloned().zip(percepts.frame(0)).collect()));
    }
    assert!(source.losses().is_empty());
    all
}

/// Whether `value` is what is `printed`, within one unit of its last digit and what it lost itself.
fn is_printed(value: f64, printed: &str, lost: f64) -> bool {
    let decimals = printed.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    let right: f64 = printed.parse().unwrap();
    (value - right).abs() <= (10_f64.powi(-(decimals as i32)) + lost) * (1.0 + 1e-9)
}

/// Counts values that are what is printed, and those that would be if they were a part in two hundred more.
#[derive(Default)]
struct Tally {
    right: usize,
    compared: usize,
    right_if_more: usize,
}

impl Tally {
    fn compare(&mut self, value: f64, printed: &str, what: &str) {
        self.compare_rounded(value, printed, 0.0, what);
    }

    /// The same of a value that is off by `lost` at most, as what it is made of is printed in few digits.
    fn compare_rounded(&mut self, value: f64, printed: &str, lost: f64, what: &str) {
        self.compared += 1;
        let right = is_printed(value, printed, lost);
        assert!(right, "{what}: {value} is printed as {printed}");
        self.right += usize::from(right);
        // Nothing more than 0 is still 0.
        self.right_if_more += usize::from(value != 0.0 && is_printed(value * 1.005, printed, lost));
    }

    /// Everything agrees, and would not if it were wrong: but for zeros and what has two digits.
    fn holds(&self, least: usize) {
        assert!(self.right == self.compared && self.compared >= least, "{} of {}", self.right, self.compared);
        assert!(self.right_if_more < self.compared / 2, "{} of {} would be right", self.right_if_more, self.compared);
    }
}

const MMHG: f64 = 133.322_387_415;

#[test]
fn xsensor_says_load_area_average_and_peak() {
    let Some(path) = recording("xsensor_first12.csv") else { return };
    xsensor_totals(&path, 12, 96);
}

#[test]
fn the_example_has_totals_that_come_out_too() {
    let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/exports/insoles.csv"));
    xsensor_totals(&path, 60, 240);
}

/// Holds the fields' percepts in both precisions to what the `frames` frames at `path` have printed beside their tables.
fn xsensor_totals(path: &PathBuf, frames: usize, least: usize) {
    let text = std::fs::read_to_string(path).unwrap();
    // By frame and side, the sensor's own keys: those up to its table.
    let mut printed: Vec<BTreeMap<String, BTreeMap<String, String>>> = Vec::new();
    let mut sensor: Option<String> = None;
    for line in text.lines() {
        let mut cells = line.split(',').map(str::trim);
        let (key, value) = (cells.next().unwrap_or(""), cells.next().unwrap_or(""));
        match key {
            "FRAME" => printed.push(BTreeMap::new()),
            "SENSOR" => sensor = Some(if value.contains("-LF") { "left" } else { "right" }.to_owned()),
            "SENSELS" | "GROUP" => sensor = None,
            _ => {
                if let (Some(sensor), Some(frame)) = (&sensor, printed.last_mut()) {
                    let key = key.split('(').next().unwrap().trim().to_owned();
                    frame.entry(sensor.clone()).or_default().insert(key, value.to_owned());
                }
            }
        }
    }
    for backend in [BackendKind::Reference, BackendKind::Cpu] {
        let (mut tally, percepts) = (Tally::default(), percepts(path, backend));
        assert_eq!((percepts.len(), printed.len()), (frames, frames));
        for ((t_s, fields), printed) in percepts.iter().zip(&printed) {
            // What is printed of groups is not of their cells alone.
            for (side, percept) in fields.iter().filter(|(side, _)| !side.contains('/')) {
                let (keys, what) = (&printed[side], format!("{backend:?}, t = {t_s}, {side}"));
                let (total, active) = (percept.total.unwrap(), f64::from(percept.active.unwrap()));
                tally.compare(percept.force.unwrap(), &keys["Est. Load"], &what);
                tally.compare(percept.area.unwrap() * 1e4, &keys["Contact Area"], &what);
                tally.compare(if active > 0.0 { total / active / MMHG } else { 0.0 }, &keys["Average Pressure"], &what);
                tally.compare(percept.peak.unwrap() / MMHG, &keys["Peak Pressure"], &what);
            }
        }
        tally.holds(least);
    }
}

#[test]
fn tekscan_says_the_sum_of_a_frame() {
    let Some(path) = recording("iscan_test.csv") else { return };
    let text = std::fs::read_to_string(&path).unwrap();
    let sums: Vec<&str> = text.lines().filter_map(|line| Some(line.split_once("Raw Sum=,,")?.1)).collect();
    let percepts = percepts(&path, BackendKind::Cpu);
    assert_eq!((percepts.len(), sums.len()), (309, 309));
    let mut more = 0;
    for ((t_s, panels), printed) in percepts.iter().zip(sums) {
        assert_eq!(panels.len(), 4);
        let sum: f64 = panels.values().map(|percept| percept.total.unwrap()).sum();
        assert_eq!(sum, printed.parse::<f64>().unwrap(), "t = {t_s}");
        more += usize::from(sum + 1.0 == printed.parse::<f64>().unwrap());
        // Counts are never newtons.
        assert!(panels.values().all(|p| p.force.is_none() && p.flags.contains(somatic::Flags::NO_UNIT)));
    }
    assert_eq!(more, 0, "a sum that is one too many is no longer what is printed");
}

#[test]
fn emed_says_the_force_of_every_row_and_column() {
    let Some(path) = recording("emed_test.lst") else { return };
    let text = String::from_utf8_lossy(&std::fs::read(&path).unwrap()).into_owned();
    let source = VendorSource::open(&path, &VendorOptions::default()).unwrap();
    let cells = &source.layout().panels[0].cells;
    assert_eq!((cells.len(), source.layout().unit.symbol()), (54 * 22, "kPa"));
    let newton_per_kpa = 1e3 * cells[0].area_m2;
    assert!((newton_per_kpa - 0.025).abs() < 1e-12);
    let all = read(&path, &VendorOptions::default()).unwrap();
    let mut tally = Tally::default();
    let mut frames = all.frames.iter();
    let (mut columns, mut by_row, mut by_column) = (Vec::new(), BTreeMap::new(), BTreeMap::new());
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["26", .., "Force"] => {
                columns = words[..words.len() - 1].to_vec();
                (by_row, by_column) = (BTreeMap::<u32, f64>::new(), BTreeMap::<u32, f64>::new());
                for (id, value) in all.ids.iter().zip(&frames.next().unwrap().1) {
                    let newton = value.number().unwrap() * newton_per_kpa;
                    *by_row.entry(id / 64 + 1).or_default() += newton;
                    *by_column.entry(id % 64 + 1).or_default() += newton;
                }
            }
            ["Force", .., total] => {
                for (column, printed) in columns.iter().zip(&words[1..]) {
                    tally.compare(by_column[&column.parse().unwrap()], printed, column);
                }
                tally.compare(by_row.values().sum(), total, "all");
            }
            [row, .., printed]
                if !columns.is_empty() && row.parse::<u32>().is_ok() && words.len() == columns.len() + 2 =>
            {
                tally.compare(by_row[&row.parse().unwrap()], printed, row);
            }
            _ => {}
        }
    }
    assert!(frames.next().is_none());
    assert_eq!((tally.compared, tally.right), (106 * (54 + 22 + 1), tally.compared));
    // Zeros stay what they are; of the others nearly all would be wrong.
    let mut forces = Tally::default();
    let totals =
        text.lines().filter(|line| line.starts_with("Force")).map(|line| line.split_whitespace().last().unwrap());
    for ((t_s, fields), printed) in percepts(&path, BackendKind::Cpu).iter().zip(totals) {
        forces.compare(fields["platform"].force.unwrap(), printed, &format!("t = {t_s}"));
    }
    forces.holds(106);
}

#[test]
fn pliance_says_force_and_centre_of_pressure() {
    let Some(path) = recording("pliance_test.asc") else { return };
    let text = std::fs::read_to_string(&path).unwrap();
    let rows = text
        .lines()
        .skip_while(|line| !line.contains("force[N]"))
        .skip(1)
        .take_while(|line| !line.starts_with("sensor"));
    let printed: BTreeMap<String, Vec<&str>> = rows
        .map(|row| row.split_whitespace().collect::<Vec<_>>())
        .filter(|words| words.len() == 4)
        .map(|words| (words[0].to_owned(), words[1..].to_vec()))
        .collect();
    for backend in [BackendKind::Reference, BackendKind::Cpu] {
        let (mut tally, percepts) = (Tally::default(), percepts(&path, backend));
        assert_eq!(percepts.len(), 281);
        for (t_s, fields) in &percepts {
            let (percept, words) = (&fields["sensor"], &printed[&format!("{t_s:.5}")]);
            // Pressures are printed to 0.001 kPa, each off by half of that at most.
            let lost = 0.5 * percept.area.unwrap();
            tally.compare_rounded(percept.force.unwrap(), words[0], lost, &format!("{backend:?}, t = {t_s}"));
            let [x, _, z] = percept.position.unwrap();
            tally.compare(100.0 * x, words[1], &format!("{backend:?}, x at t = {t_s}"));
            tally.compare(-100.0 * z, words[2], &format!("{backend:?}, y at t = {t_s}"));
        }
        tally.holds(3 * 281);
    }
}

#[test]
fn pedar_has_two_feet_and_no_places() {
    let Some(path) = recording("pedar_example.asc") else { return };
    let all = read(&path, &VendorOptions::default()).unwrap();
    let names: Vec<&str> = all.layout.panels.iter().map(|panel| panel.name.as_str()).collect();
    assert_eq!((names, all.frames.len(), all.ids.len()), (vec!["left", "right"], 1505, 198));
    assert!(!all.layout.is_placed());
    let text = std::fs::read_to_string(&path).unwrap();
    let rows = text.lines().skip_while(|line| !line.starts_with("time[")).skip(1);
    for (row, (t_s, values)) in rows.zip(&all.frames) {
        let mut words = row.split_whitespace().map(|word| word.parse::<f64>().unwrap());
        assert_eq!(words.next(), Some(*t_s));
        assert!(values.iter().map(|value| value.number()).eq(words.map(Some)), "t = {t_s}");
    }
    for (_, fields) in percepts(&path, BackendKind::Cpu).iter().take(50) {
        let flags = fields["left"].flags;
        assert!(
            flags.contains(somatic::Flags::NO_CHART | somatic::Flags::NO_UNIT) && fields["left"].centroid.is_none()
        );
    }
}
