//! Frames from an engine to the bytes that a viewer gets; and the file of messages that the page decodes in its own tests.

mod decode;
mod touches;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::{DAffine3, DQuat, DVec3};
use serde_json::{Value, json};

use self::decode::{decode_frame, decode_history, decode_mesh, decode_peaks, welcome};
use super::current::Current;
use super::encode::{History, PeakMap};
use super::exchange::Exchange;
use super::log::EventKind;
use super::message::{Message, parse};
use super::publish::{PageInput, Publisher};
use super::scale::{Scale, ScaleFrom};
use super::scene::{Mode, PageInfo, PageScene};
use super::text;
use super::viewer::Viewer;
use super::wake::Waits;
use crate::body::{Body, ChartKind, ChartSpec, FieldSpec, Home, Link, MemberSpec, Modality, Surface, Taxel};
use crate::signal::{BoardHealth, Calibration, Frame, Pose, RawValue, Receptor, Wiring};
// Before it an engine, as in a run.
#[cfg(test)]
use somatic_engine::percept::Outputs;
use somatic_engine::scene::Scene;
use somatic_engine::{BackendKind, Engine, Options, touch};
use somatic_skin::signal::Letter;

/// Three links, two of them with a triangle and taxels and no common ancestor, and three fields, one of them on both.
fn body() -> Body {
    let link = |name: &str, parent, x: f64| {
        let body_from_link = DAffine3::from_translation(DVec3::new(x, 0.0, 0.0));
        Link {
            name: name.to_owned(),
            parent,
            body_from_link,
            link_from_node: DAffine3::IDENTITY,
            joint: None,
            urdf_up: None,
        }
    };
    let surface = |link: usize| Surface {
        name: format!("surface {link}"),
        positions: [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.0, -0.1]].map(DVec3::from_array).to_vec(),
        triangles: vec![[0, 1, 2]],
        home: Home::Rigid { link, link_from_mesh: DAffine3::IDENTITY },
    };
    let taxel = |id: u32, link: usize, x: f64, z: f64| Taxel {
        id,
        link,
        position_in_link: DVec3::new(x, 0.0, -z),
        normal_in_link: DVec3::Y,
        area: if id == 7 { 0.0 } else { 1e-4 },
        modality: Modality::Pressure,
        tangent_in_link: None,
    };
    let field = |name: &str, parent: Option<&str>, ids: &[u32], kind| FieldSpec {
        name: name.to_owned(),
        parent: parent.map(str::to_owned),
        members: ids.iter().map(|&id| (id, MemberSpec { weight: f64::from(1 + id % 2), uv: None })).collect(),
        chart: Some(ChartSpec { kind, origin_in_anchor: None, u_in_anchor: None }),
    };
    Body {
        name: "<b>two</b> & \"links\"".to_owned(),
        links: vec![link("arm", None, 1.0), link("hand", None, 2.0), link("finger", Some(0), 3.0)],
        surfaces: vec![surface(0), surface(1)],
        taxels: vec![
            taxel(2, 0, 0.01, 0.01),
            taxel(3, 0, 0.03, 0.01),
            taxel(4, 0, 0.01, 0.03),
            taxel(7, 1, 0.02, 0.02),
            taxel(9, 1, 0.03, 0.02),
        ],
        fields: vec![
            field("all", None, &[], ChartKind::Plane),
            field("all/arm", Some("all"), &[2, 3, 4], ChartKind::Plane),
            field("all/hand", Some("all"), &[7, 9], ChartKind::None),
        ],
        edges: None,
        findings: Vec::new(),
        kept: Default::default(),
    }
}

/// The last of the frames that `engine` went through.
fn input_of<'a>(engine: &'a Engine, frame: &'a Frame, arrived: Instant) -> PageInput<'a> {
    PageInput {
        frame,
        values_read: engine.values_read(),
        values_noted: engine.values_noted(),
        values_sensed: engine.values_sensed(),
        plan: engine.plan(),
        arrived: Some(arrived),
        call_us: 12.5,
        number: None,
    }
}

/// Everything from an engine to a viewer, without sockets.
struct Bench {
    engine: Engine,
    scene: PageScene,
    exchange: Arc<Exchange>,
    publisher: Publisher,
    current: Current,
    arrived: Instant,
}

impl Bench {
    /// Without touches of the whole body.
    fn new(outputs: Outputs, letters: &[Receptor], calibration: &str) -> Self {
        Self::with_scene(Scene::default().outputs(outputs).letters(Letter::all_of(letters, &[])), calibration)
    }

    fn with_scene(scene: Scene, calibration: &str) -> Self {
        let body = body();
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let options = Options::default()
            .scene(scene)
            .calibration(Calibration::parse(calibration, &ids).unwrap())
            .backend(BackendKind::Reference);
        let mut engine = Engine::new(&body, options).unwrap();
        engine.track_stale();
        engine.keep_touch_taxels(true);
        let wiring = Wiring::in_order(&ids[1..], 5, 2).unwrap();
        let info = PageInfo {
            source: "touch.csv",
            mode: Mode::Recording { start_s: 0.0, end_s: 12.5, frames: 1251 },
            backend: ["reference", "double precision", "asked for"],
            taxels: &ids,
            wiring: Some(&wiring),
            recorded_max: None,
            recorded_senses: Default::default(),
        };
        let scene = PageScene::new(&body, engine.plan(), &info);
        let (_waits, waker) = Waits::new().unwrap();
        let exchange = Arc::new(Exchange::new(engine.plan(), waker));
        let publisher = Publisher::new(Arc::clone(&exchange), &scene);
        let current = Current::new(&scene);
        Self { engine, scene, exchange, publisher, current, arrived: Instant::now() }
    }

    fn frame(&self, t_s: f64, values: [f64; 5]) -> Frame {
        let value = |value: f64| if value == -9.0 { RawValue::STALE } else { RawValue::new(value) };
        Frame { t_s, values: values.map(value).to_vec(), ..Frame::default() }
    }

    /// Through the engine, and over to the server's side.
    fn process(&mut self, frames: &[Frame]) {
        self.engine.process(frames).unwrap();
        self.publisher.read(&input_of(&self.engine, &frames[frames.len() - 1], self.arrived));
        self.publisher.publish(self.engine.percepts());
        let mut shared = self.exchange.lock();
        assert!(std::mem::take(&mut shared.is_new));
        self.current.swap(&mut shared.snapshot);
    }

    /// What the server's thread does for a viewer.
    fn send(&mut self, viewer: &mut Viewer) -> Vec<u8> {
        assert!(viewer.wants_frame(self.current.snapshot().published));
        self.current.read();
        let (newest, series) = {
            let mut shared = self.exchange.lock();
            viewer.take_values(&shared.trail, &shared.series);
            shared.trail.clear();
            (shared.log.newest(), viewer.series().to_vec())
        };
        assert!(series.len() <= 16);
        viewer.frame(&self.current, newest)
    }

    fn plot(&mut self, viewer: &mut Viewer, text: &str) {
        let Message::Series(series) = parse(text, &self.scene.counts).unwrap() else { panic!("series") };
        viewer.set_series(series.clone());
        let mut shared = self.exchange.lock();
        shared.series = series.into();
        shared.trail = super::series::Trail::new(shared.series.len(), 16);
    }
}

/// Messages one after the other, and what they hold.
#[derive(Default)]
struct Book {
    bytes: Vec<u8>,
    entries: Vec<Value>,
}

impl Book {
    fn add(&mut self, name: &str, message: &[u8], values: &Value) {
        let binary = std::str::from_utf8(message).map_or(true, |text| !text.starts_with('{'));
        self.entries.push(json!({
            "name": name, "binary": binary, "offset": self.bytes.len(), "length": message.len(), "values": values,
        }));
        self.bytes.extend_from_slice(message);
        // So that arrays of f64 can be looked at where they lie.
        self.bytes.resize(self.bytes.len().next_multiple_of(8), 0);
    }

    fn add_text(&mut self, text: &str) {
        let values: Value = serde_json::from_str(text).unwrap();
        self.add(values["type"].as_str().unwrap(), text.as_bytes(), &values);
    }
}

const ALL_LETTERS: [Receptor; 2] = [Receptor::Sustained, Receptor::Change];

fn book() -> Book {
    let letters = Letter::all_of(&ALL_LETTERS, &[]);
    let scene = Scene::default().outputs(Outputs::USUAL_AND_MOTION | Outputs::SELF_CONTACTS).letters(letters);
    let scene = scene.touches(touch::Options::default());
    let mut bench = Bench::with_scene(scene, "[all]\np_max = 100\n[taxel.9]\nmask = true");
    let mut viewer = Viewer::new(0);
    let mut book = Book::default();
    book.add_text(&welcome(&bench.scene).replace(env!("CARGO_PKG_VERSION"), "0.0.0"));
    let mesh = bench.scene.mesh.clone();
    book.add("mesh", &mesh, &decode_mesh(&mesh));
    let add_frame = |book: &mut Book, bench: &mut Bench, viewer: &mut Viewer, name: &str| {
        let message = bench.send(viewer);
        book.add(name, &message, &decode_frame(&message, &bench.scene));
        viewer.drawn(u32::from_le_bytes(message[4..8].try_into().unwrap()), bench.arrived + Duration::from_millis(5));
    };
    let first = bench.frame(0.0, [0.0; 5]);
    bench.process(&[first]);
    add_frame(&mut book, &mut bench, &mut viewer, "nothing is touched");
    let Ok(Message::Columns(columns)) =
        parse(r#"{"type":"columns","columns":["total","centroid","position","orientation"]}"#, &bench.scene.counts)
    else {
        panic!("columns")
    };
    viewer.set_columns(columns);
    bench.plot(
        &mut viewer,
        r#"{"type":"series","series":[{"field":2,"column":"total","component":0},{"field":2,"column":"centroid","component":1},
            {"field":0,"column":"peak","component":0}]}"#,
    );
    // The engine's side learns with this one what is plotted.
    let second = bench.frame(0.01, [5.0, 0.0, 0.0, 0.0, 0.0]);
    bench.process(&[second]);
    let batch: Vec<Frame> =
        (2..5).map(|i| bench.frame(0.01 * f64::from(i), [f64::from(i), 50.0, 0.5, 150.0, 7.0])).collect();
    bench.process(&batch);
    add_frame(&mut book, &mut bench, &mut viewer, "everything");
    let same = batch[2].clone();
    viewer.set_series(Vec::new());
    bench.process(&[Frame { t_s: 0.05, ..same.clone() }]);
    add_frame(&mut book, &mut bench, &mut viewer, "the change has passed");
    bench.process(&[Frame { t_s: 0.06, ..same.clone() }]);
    add_frame(&mut book, &mut bench, &mut viewer, "nothing has changed");
    let pose = Pose { translation: DVec3::new(1.0, 0.5, 0.0), rotation: DQuat::from_rotation_z(0.25) };
    let posed = Frame {
        t_s: 0.07,
        values: vec![RawValue::MISSING, RawValue::FAULTY, RawValue::STALE, RawValue::new(3.0), RawValue::new(1.0)],
        pose: vec![("arm".to_owned(), pose)],
        ..Frame::default()
    };
    bench.process(&[posed]);
    add_frame(&mut book, &mut bench, &mut viewer, "posed, and what is wrong with taxels");
    // The hand where the arm is, turned over: its first taxel lies on the arm's first and faces it.
    let at =
        |x: f64, z: f64, turn: f64| Pose { translation: DVec3::new(x, 0.0, z), rotation: DQuat::from_rotation_x(turn) };
    let pose = vec![("arm".to_owned(), at(1.0, 0.0, 0.0)), ("hand".to_owned(), at(0.99, -0.03, std::f64::consts::PI))];
    let meeting = Frame { pose, ..bench.frame(0.08, [5.0, 0.0, 0.0, 3.0, 0.0]) };
    bench.process(&[meeting]);
    add_frame(&mut book, &mut bench, &mut viewer, "two links touch");
    let history = History {
        id: 7,
        from_s: 0.5,
        to_s: 2.5,
        bins: 3,
        series: vec![[vec![1.0, f32::NAN, 0.25], vec![2.0, f32::NAN, 0.5]], [vec![f32::NAN; 3], vec![f32::NAN; 3]]],
    };
    let message = history.message();
    book.add("history", &message, &decode_history(&message));
    let message = PeakMap { id: 8, from_s: 0.5, to_s: 2.5, peaks: vec![0.0, 2.5, f32::NAN, 1.0, 7.0] }.message();
    book.add("peaks", &message, &decode_peaks(&message, 5));
    book.add_text(&text::scale(Scale { max: 0.2, from: ScaleFrom::Grown }, None));
    bench.publisher.event(EventKind::Board, 0.5, None, "tty1: unplugged".to_owned());
    bench.publisher.flush();
    let (lost, events) = bench.exchange.lock().log.after(0, 100);
    book.add_text(&text::events(lost, &events, &bench.scene.names));
    let board = BoardHealth { name: "board 5".to_owned(), state: "speaking".to_owned(), ..BoardHealth::default() };
    book.add_text(&text::boards(&[BoardHealth { rate_hz: Some(249.5), age_s: Some(0.25), ..board.clone() }, board]));
    for taxel in [0, 3] {
        let reading = bench.current.taxel(taxel);
        book.add_text(&text::taxel(taxel, 0.07, &reading));
    }
    book.add_text(&text::live_status(false));
    book.add_text(&text::no_explanation(2, "not kept"));
    book.add_text(&text::ended("the source has ended"));
    book
}

/// `SOMATIC_WRITE_MESSAGES=1` writes the files anew; the page's tests read them.
#[test]
fn messages_are_those_that_the_page_decodes() {
    let book = book();
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/page");
    let entries = Value::from(book.entries);
    if std::env::var("SOMATIC_WRITE_MESSAGES").is_ok_and(|wanted| wanted == "1") {
        std::fs::write(folder.join("messages.bin"), &book.bytes).unwrap();
        std::fs::write(folder.join("messages.json"), format!("{entries:#}\n")).unwrap();
    }
    let kept = |name: &str| std::fs::read(folder.join(name)).unwrap_or_default();
    let why = "tests/page has other messages; if these are right, write them with SOMATIC_WRITE_MESSAGES=1";
    assert!(kept("messages.bin") == book.bytes, "{why}");
    // A formatter may have been at it.
    assert!(serde_json::from_slice::<Value>(&kept("messages.json")).is_ok_and(|kept| kept == entries), "{why}");
}

fn named(book: &Book) -> BTreeMap<String, Value> {
    book.entries.iter().map(|entry| (entry["name"].as_str().unwrap().to_owned(), entry["values"].clone())).collect()
}

#[test]
fn frames_hold_what_the_engine_computed() {
    let book = book();
    let messages = named(&book);
    let everything = &messages["everything"];
    let welcome = &messages["welcome"];
    assert_eq!((&everything["frame"], &everything["t"], &everything["skipped"]), (&4.into(), &0.04.into(), &3.into()));
    assert_eq!(everything["pressure"], json!([4.0, 50.0, 0.5, 150.0, null]));
    assert_eq!(everything["health"], json!([0, 0, 0, 4, 6]));
    // The first three are sustained letters beside changes: fields 0, 2 and 4.
    assert_eq!(welcome["fields"][2]["label"], "all/arm · sustained");
    assert_eq!((&welcome["fields"][2]["parent"], &welcome["fields"][3]["parent"]), (&json!(0), &json!(1)));
    assert_eq!(welcome["fields"][2]["members"], json!([0, 1, 2]));
    assert_eq!((&welcome["fields"][0]["link"], &welcome["fields"][4]["link"]), (&json!(null), &json!(1)));
    assert_eq!(welcome["channels"], json!([null, [5, 0], [5, 1], [6, 0], [6, 1]]));
    let at = everything["percepts"]["field"].as_array().unwrap().iter().position(|field| field == 2).unwrap();
    assert_eq!(everything["percepts"]["columns"]["0"][at], 4.0 + 2.0 * 50.0 + 0.5);
    // A field of two links answers in the world, relative to the scene's origin.
    assert_eq!(everything["percepts"]["present"][1].as_u64().unwrap() >> 31, 1);
    let samples = &everything["samples"];
    assert_eq!((&samples["answers"], &samples["t"]), (&1.into(), &json!([0.02, 0.03, 0.04])));
    assert_eq!(samples["values"][0], json!([102.5, 103.5, 104.5]));
    assert!(!everything["touches"].as_array().unwrap().is_empty());
    let unchanged = &messages["nothing has changed"];
    // Touches grow older.
    for part in ["pressure", "pose", "samples"] {
        assert_eq!(unchanged[part], Value::Null, "{part}");
    }
    let length = |name: &str| book.entries.iter().find(|entry| entry["name"] == name).unwrap()["length"].clone();
    // Head, pressures with health, and that there is no contact.
    assert_eq!(length("nothing is touched"), 72 + 32 + 8);
    let posed = &messages["posed, and what is wrong with taxels"];
    assert_eq!(posed["health"], json!([1, 3, 2, 0, 6]));
    assert!(posed["pose"].is_array() && posed["p50"].as_f64().is_some_and(|ms| (ms - 5.0).abs() < 1e-3));
    let meeting = &messages["two links touch"]["selfContacts"];
    let contact = &meeting["list"][0];
    assert!(welcome["self_contacts"] == true && meeting["known"] == true, "{meeting}");
    assert_eq!((&contact["sides"][0]["link"], &contact["sides"][1]["link"]), (&0.into(), &1.into()));
    // Of the one taxel on each side.
    assert_eq!((&contact["sides"][0]["total"], &contact["sides"][1]["total"]), (&5.0.into(), &3.0.into()));
    let origin = welcome["origin"].as_array().unwrap();
    for (axis, place) in [1.01, 0.0, -0.01].into_iter().enumerate() {
        let sent = contact["position"][axis].as_f64().unwrap() + origin[axis].as_f64().unwrap();
        assert!((sent - place).abs() < 1e-6, "{contact}");
    }
    // Its frame has no pose: where touches are in the world is not known.
    assert_eq!((&everything["selfContacts"]["known"], &unchanged["selfContacts"]), (&false.into(), &Value::Null));
    let events = &messages["events"]["events"];
    assert_eq!((&events[0]["kind"], &events[0]["seq"]), (&"onset".into(), &1.into()));
}

#[test]
fn a_viewer_has_credit_for_two_frames_and_the_newest_wins() {
    let mut bench = Bench::new(Outputs::TOTAL, &ALL_LETTERS[..1], "");
    let mut viewer = Viewer::new(0);
    let mut sent = Vec::new();
    for i in 0..100 {
        let frame = bench.frame(f64::from(i), [f64::from(i); 5]);
        bench.process(&[frame]);
        if viewer.wants_frame(bench.current.snapshot().published) {
            sent.push(bench.send(&mut viewer));
        }
    }
    assert_eq!(sent.len(), 2, "what is not drawn gives no credit");
    let now = bench.arrived + Duration::from_millis(1);
    viewer.drawn(9, now);
    let newest = decode_frame(&bench.send(&mut viewer), &bench.scene);
    assert_eq!((&newest["frame"], &newest["skipped"]), (&99.into(), &97.into()));
    assert!(!viewer.wants_frame(bench.current.snapshot().published), "it has the newest");
    viewer.set_columns(1);
    let again = decode_frame(&bench.send(&mut viewer), &bench.scene);
    assert_eq!((&again["frame"], &again["skipped"]), (&99.into(), &97.into()));
    // A parent has its descendants' taxels, each once.
    assert_eq!(again["percepts"]["columns"]["0"][0], 99.0 * 5.0);
}

#[test]
fn the_steady_state_does_not_allocate() {
    let scene = Scene::default().outputs(Outputs::USUAL_AND_MOTION).touches(touch::Options::default());
    let mut bench = Bench::with_scene(scene, "");
    let mut viewer = Viewer::new(0);
    let text = r#"{"type":"series","series":[{"field":1,"column":"total","component":0}]}"#;
    bench.plot(&mut viewer, text);
    let frame = bench.frame(0.0, [1.0; 5]);
    for _ in 0..20 {
        bench.process(std::slice::from_ref(&frame));
    }
    bench.engine.process_one(&frame).unwrap();
    let (publisher, percepts) = (&mut bench.publisher, bench.engine.percepts());
    let input = input_of(&bench.engine, &frame, bench.arrived);
    let measured = allocation_counter::measure(|| {
        for _ in 0..1000 {
            publisher.read(&input);
            publisher.publish(percepts);
        }
    });
    assert_eq!(measured.count_total, 0);
    // The counter does count.
    assert!(allocation_counter::measure(|| drop(std::hint::black_box(vec![1_u8]))).count_total > 0);
}

#[test]
fn a_viewer_owes_what_it_has_not_drawn() {
    let mut bench = Bench::new(Outputs::USUAL_AND_MOTION, &ALL_LETTERS[..1], "");
    let mut viewer = Viewer::new(0);
    assert_eq!(viewer.owes_since(), None);
    let frame = bench.frame(0.0, [1.0; 5]);
    bench.process(std::slice::from_ref(&frame));
    let message = bench.send(&mut viewer);
    assert!(viewer.owes_since().is_some_and(|since| since.elapsed() < Duration::from_secs(60)));
    viewer.drawn(u32::from_le_bytes(message[4..8].try_into().unwrap()), bench.arrived);
    assert_eq!(viewer.owes_since(), None);
}

#[test]
fn a_page_gets_the_unit_of_pressure() {
    let welcome = |calibration: &str| -> Value {
        let bench = Bench::new(Outputs::TOTAL | Outputs::FORCE, &ALL_LETTERS[..1], calibration);
        serde_json::from_str(&welcome(&bench.scene)).unwrap()
    };
    let units = |welcome: &Value| -> Vec<Value> {
        welcome["columns"].as_array().unwrap().iter().map(|column| column["unit"].clone()).collect()
    };
    let kilopascal = welcome("[all]\nunit = \"kPa\"\np_max = 50\n");
    assert_eq!((&kilopascal["quantity"], &kilopascal["scale"]["max"]), (&json!("Pa"), &json!(50_000.0)));
    assert_eq!(units(&kilopascal), ["Pa", "N"]);
    let count = welcome("[all]\np_max = 50\n");
    assert_eq!((&count["quantity"], &count["scale"]["max"]), (&json!("count"), &json!(50.0)));
    assert_eq!(units(&count), ["count", "N"]);
}
