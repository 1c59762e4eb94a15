//! Frames from an engine to the bytes that a viewer gets; and the file of messages that the page decodes in its own tests.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::{DAffine3, DQuat, DVec3};
use serde_json::{Value, json};

use super::current::Current;
use super::encode::History;
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
use crate::{BackendKind, Engine, Letter, Options, Outputs};

/// Three links, two of them with a triangle and taxels and no common ancestor, and three fields, one of them on both.
fn body() -> Body {
    let link = |name: &str, parent, x: f64| {
        let world_from_link = DAffine3::from_translation(DVec3::new(x, 0.0, 0.0));
        Link { name: name.to_owned(), parent, world_from_link, link_from_node: DAffine3::IDENTITY }
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
        findings: Vec::new(),
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
    fn new(outputs: Outputs, letters: &[Receptor], calibration: &str) -> Self {
        let body = body();
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let scene = crate::Scene::default().outputs(outputs).letters(Letter::all_of(letters, &[]));
        let options = Options::default()
            .scene(scene)
            .calibration(Calibration::parse(calibration, &ids).unwrap())
            .backend(BackendKind::Reference);
        let mut engine = Engine::new(&body, options).unwrap();
        engine.track_stale();
        let wiring = Wiring::in_order(&ids[1..], 5, 2).unwrap();
        let info = PageInfo {
            source: "touch.csv",
            mode: Mode::Recording { start_s: 0.0, end_s: 12.5, frames: 1251 },
            backend: ["reference", "double precision", "asked for"],
            taxels: &ids,
            wiring: Some(&wiring),
            recorded_max: None,
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
        Frame { t_s, values: values.map(value).to_vec(), pose: Vec::new() }
    }

    /// Through the engine, and over to the server's side.
    fn process(&mut self, frames: &[Frame]) {
        self.engine.process(frames).unwrap();
        self.publisher.read(&PageInput {
            frame: &frames[frames.len() - 1],
            values_read: self.engine.values_read(),
            plan: self.engine.plan(),
            arrived: Some(self.arrived),
            call_us: 12.5,
            number: None,
        });
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

/// Reads what a page reads, by the protocol's tables.
struct Reader<'a>(&'a [u8], usize);

impl Reader<'_> {
    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let bytes = self.0[self.1..self.1 + N].try_into().unwrap();
        self.1 += N;
        bytes
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.bytes())
    }

    fn f32(&mut self) -> Value {
        let number = f32::from_le_bytes(self.bytes());
        if number.is_nan() { Value::Null } else { f64::from(number).into() }
    }

    fn f64(&mut self) -> f64 {
        f64::from_le_bytes(self.bytes())
    }

    fn u32s(&mut self, count: u32) -> Vec<u32> {
        (0..count).map(|_| self.u32()).collect()
    }

    fn f32s(&mut self, count: u32) -> Vec<Value> {
        (0..count).map(|_| self.f32()).collect()
    }

    fn pad(&mut self) {
        while !self.1.is_multiple_of(8) {
            assert_eq!(self.bytes::<1>(), [0]);
        }
    }

    fn ends(self) {
        assert_eq!(self.1, self.0.len());
    }
}

fn decode_mesh(bytes: &[u8]) -> Value {
    let mut from = Reader(bytes, 0);
    assert_eq!(from.bytes(), [1, 1, 0, 0]);
    let [v, t, n, l] = [0; 4].map(|_| from.u32());
    let mesh = json!({
        "position": from.f32s(3 * v), "normal": from.f32s(3 * v), "link": from.u32s(v), "corners": from.u32s(3 * t),
        "taxelId": from.u32s(n), "taxelLink": from.u32s(n), "taxelPosition": from.f32s(3 * n),
        "taxelNormal": from.f32s(3 * n), "taxelRadius": from.f32s(n), "taxelArea": from.f32s(n),
        "restPose": from.f32s(7 * l),
    });
    from.ends();
    mesh
}

fn decode_frame(bytes: &[u8], scene: &PageScene) -> Value {
    let mut from = Reader(bytes, 0);
    let [kind, version, sections, zero] = from.bytes();
    assert_eq!((kind, version, zero), (2, 1, 0));
    let mut frame = json!({"seq": from.u32()});
    frame["frame"] = u64::from_le_bytes(from.bytes()).into();
    frame["t"] = from.f64().into();
    frame["skipped"] = from.u32().into();
    frame["p50"] = from.f32();
    frame["p99"] = from.f32();
    let [fields, touches, samples, newest, columns] = [0; 5].map(|_| from.u32());
    frame["newestEvent"] = newest.into();
    frame["engineMicroseconds"] = from.f32();
    let answers = from.u32();
    for part in ["pressure", "health", "pose", "percepts", "touches", "samples"] {
        frame[part] = Value::Null;
    }
    let taxels = scene.counts.taxels as u32;
    if sections & 1 != 0 {
        frame["pressure"] = from.f32s(taxels).into();
        frame["health"] = (0..taxels).map(|_| from.bytes::<1>()[0]).collect::<Vec<_>>().into();
        from.pad();
    }
    if sections & 2 != 0 {
        frame["pose"] = from.f32s(7 * scene.poses.seven().len() as u32).into();
        from.pad();
    }
    if sections & 4 != 0 {
        let mut percepts = json!({"field": from.u32s(fields), "flags": from.u32s(fields), "present": from.u32s(fields), "columns": {}});
        for (index, column) in scene.counts.columns.iter().enumerate().filter(|(index, _)| columns >> index & 1 != 0) {
            percepts["columns"][index.to_string()] = from.f32s(fields * column.components as u32).into();
        }
        from.pad();
        frame["percepts"] = percepts;
    }
    if sections & 8 != 0 {
        let mut touch = |_| {
            let [field, identity] = [0; 2].map(|_| from.u32());
            let (total, active) = (from.f32(), from.u32());
            json!({"field": field, "identity": identity, "total": total, "active": active, "centroid": from.f32s(2),
                   "position": from.f32s(3)})
        };
        frame["touches"] = (0..touches).map(&mut touch).collect::<Vec<_>>().into();
        from.pad();
    }
    if sections & 16 != 0 {
        let t: Vec<f64> = (0..samples).map(|_| from.f64()).collect();
        let series = (bytes.len() - from.1) as u32 / (4 * samples);
        let values: Vec<Vec<Value>> = (0..series).map(|_| from.f32s(samples)).collect();
        frame["samples"] = json!({"answers": answers, "t": t, "values": values});
        from.pad();
    }
    from.ends();
    frame
}

fn decode_history(bytes: &[u8]) -> Value {
    let mut from = Reader(bytes, 0);
    assert_eq!(from.bytes(), [3, 1, 0, 0]);
    let [id, bins, series] = [0; 3].map(|_| from.u32());
    let (begin, end) = (from.f64(), from.f64());
    let ends: Vec<[Vec<Value>; 2]> = (0..series).map(|_| [from.f32s(bins), from.f32s(bins)]).collect();
    from.ends();
    json!({"id": id, "bins": bins, "from": begin, "to": end,
           "least": ends.iter().map(|ends| &ends[0]).collect::<Vec<_>>(),
           "most": ends.iter().map(|ends| &ends[1]).collect::<Vec<_>>()})
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
    let outputs = Outputs::USUAL | Outputs::TOUCHES;
    let mut bench = Bench::new(outputs, &ALL_LETTERS, "[all]\np_max = 100\n[taxel.9]\nmask = true");
    let mut viewer = Viewer::new(0);
    let mut book = Book::default();
    book.add_text(&bench.scene.welcome("00ff", bench.scene.scale).replace(env!("CARGO_PKG_VERSION"), "0.0.0"));
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
    };
    bench.process(&[posed]);
    add_frame(&mut book, &mut bench, &mut viewer, "posed, and what is wrong with taxels");
    let history = History {
        id: 7,
        from_s: 0.5,
        to_s: 2.5,
        bins: 3,
        series: vec![[vec![1.0, f32::NAN, 0.25], vec![2.0, f32::NAN, 0.5]], [vec![f32::NAN; 3], vec![f32::NAN; 3]]],
    };
    let message = history.message();
    book.add("history", &message, &decode_history(&message));
    book.add_text(&text::scale(Scale { max: 0.2, from: ScaleFrom::Grown }));
    bench.publisher.event(EventKind::Board, 0.5, None, "tty1: unplugged".to_owned());
    bench.publisher.flush();
    let (lost, events) = bench.exchange.lock().log.after(0, 100);
    book.add_text(&text::events(lost, &events, &bench.scene.labels));
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
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/page");
    let text = format!("{:#}\n", Value::from(book.entries));
    let files = [("messages.bin", book.bytes), ("messages.json", text.into_bytes())];
    for (name, bytes) in files {
        if std::env::var("SOMATIC_WRITE_MESSAGES").is_ok_and(|wanted| wanted == "1") {
            std::fs::write(folder.join(name), &bytes).unwrap();
        }
        let kept = std::fs::read(folder.join(name)).unwrap_or_default();
        assert!(kept == bytes, "tests/page/{name} is of other messages; if that is right, SOMATIC_WRITE_MESSAGES=1");
    }
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
    let totals = &everything["percepts"]["columns"]["0"];
    assert_eq!(totals[at], 4.0 + 2.0 * 50.0 + 0.5);
    // A field of two links answers in the world, relative to the scene's origin.
    assert_eq!(everything["percepts"]["present"][0].as_u64().unwrap() >> 31, 1);
    let samples = &everything["samples"];
    assert_eq!((&samples["answers"], &samples["t"]), (&1.into(), &json!([0.02, 0.03, 0.04])));
    assert_eq!(samples["values"][0], json!([102.5, 103.5, 104.5]));
    assert!(!everything["touches"].as_array().unwrap().is_empty());
    let unchanged = &messages["nothing has changed"];
    for part in ["pressure", "pose", "touches", "samples"] {
        assert_eq!(unchanged[part], Value::Null, "{part}");
    }
    let length = |name: &str| book.entries.iter().find(|entry| entry["name"] == name).unwrap()["length"].clone();
    assert_eq!(length("nothing is touched"), 64 + 32);
    let posed = &messages["posed, and what is wrong with taxels"];
    assert_eq!(posed["health"], json!([1, 3, 2, 0, 6]));
    assert!(posed["pose"].is_array() && posed["p50"].as_f64().is_some_and(|ms| (ms - 5.0).abs() < 1e-3));
    let events = &messages["events"]["events"];
    assert!(events.as_array().unwrap().iter().any(|event| event["text"] == "all/arm · sustained is touched"));
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
    let mut bench = Bench::new(Outputs::USUAL, &ALL_LETTERS[..1], "");
    let mut viewer = Viewer::new(0);
    let text = r#"{"type":"series","series":[{"field":1,"column":"total","component":0}]}"#;
    bench.plot(&mut viewer, text);
    let frame = bench.frame(0.0, [1.0; 5]);
    for _ in 0..20 {
        bench.process(std::slice::from_ref(&frame));
    }
    bench.engine.process_one(&frame).unwrap();
    let (publisher, percepts) = (&mut bench.publisher, bench.engine.percepts());
    let input = PageInput {
        frame: &frame,
        values_read: bench.engine.values_read(),
        plan: bench.engine.plan(),
        arrived: None,
        call_us: 1.0,
        number: None,
    };
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
