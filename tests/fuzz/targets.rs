//! The parsers: what is sound for each, and what must hold of whatever it makes of the rest.

use std::io::Cursor;

use somatic::author::Recipe;
use somatic::author::mesh::{MeshOptions, author_mjcf_skin, author_urdf_skin};
use somatic::internal::author::icub::IcubFile;
use somatic::internal::body::{Original, read_taxel_table};
use somatic::internal::recording::BagSurvey;
use somatic::internal::robot::BagSource;
use somatic::internal::robot::messages::{Float32MultiArray, JointState, Message, PointCloud2, TfMessage};
use somatic::internal::source::{ArrayMap, BagName, JointStates, JsonLines, MappedSource};
use somatic::internal::wire::{Decoder, Event};
use somatic::recording::Reader;
use somatic::robot::Kinematics;
use somatic::signal::Wiring;
use somatic::sink::SinkSpec;
use somatic::source::{
    CsvSource, NdjsonSource, SimulatedSource, Source, SourceSpec, TextSource, VendorFormat, VendorOptions, VendorSource,
};
use somatic::{Body, Calibration, Frame, RawValue, Result, bundled};

use super::program::{self, Page};
use super::seeds::{self, file};
use super::{Case, Target, Verdict};
use crate::make::{self, Dialect, PLAIN};

/// Frames that a case gives at most; more were made out of nothing.
const MAX_FRAMES: usize = 200_000;

fn target(
    name: &'static str,
    file: &'static str,
    seeds: impl IntoIterator<Item = impl Into<Vec<u8>>>,
    check: impl Fn(&Case<'_>) -> Verdict + Send + 'static,
) -> Target {
    Target { name, file, seeds: seeds.into_iter().map(Into::into).collect(), check: Box::new(check) }
}

/// Whether a parser takes it; an error must be a line that says something.
fn verdict<T>(result: Result<T>) -> Verdict {
    match result {
        Ok(_) => Ok(true),
        Err(e) => {
            let line = e.to_string();
            if line.len() < 8 || line.contains('\n') {
                return Err(format!("its error is not a line: {line:?}"));
            }
            Ok(false)
        }
    }
}

/// What is read of a recording: times and values, and what is said to be lost.
type Frames = (Vec<(u64, Vec<RawValue>)>, Vec<String>);

fn frames(source: &mut dyn Source) -> Result<Frames> {
    let mut frame = Frame::missing(0.0, source.taxels().len());
    let mut frames = Vec::new();
    while frames.len() < MAX_FRAMES && source.next_frame(&mut frame)? {
        frames.push((frame.t_s.to_bits(), frame.values.clone()));
    }
    Ok((frames, source.losses()))
}

/// Rows of `text` that hold something.
fn rows(text: &str) -> usize {
    text.split('\n').filter(|line| !line.trim().is_empty()).count()
}

pub(super) fn csv() -> Target {
    let seeds = [seeds::CSV.as_bytes().to_vec(), file("examples/robots/arm-touch.csv")];
    target("csv", "a.csv", seeds, |case| {
        let read = CsvSource::from_reader("a.csv", Cursor::new(case.bytes.to_vec()), None, None);
        let (frames, losses) = match read.and_then(|mut source| frames(&mut source)) {
            Ok(read) => read,
            Err(e) => return verdict::<()>(Err(e)),
        };
        let expected = rows(&case.text()).saturating_sub(1);
        if losses.is_empty() && frames.len() < expected {
            return Err(format!("{} frames of {expected} rows, and nothing is said to be lost", frames.len()));
        }
        Ok(true)
    })
}

pub(super) fn ndjson() -> Target {
    let seeds = [seeds::NDJSON.as_bytes().to_vec(), file("examples/robots/arm-drive.ndjson")];
    target("ndjson", "a.ndjson", seeds, |case| {
        let mut source = NdjsonSource::new("a", Cursor::new(case.bytes.to_vec()), (0..64).collect());
        match frames(&mut source) {
            Ok((frames, losses)) if losses.is_empty() && frames.len() < rows(&case.text()).min(MAX_FRAMES) => {
                Err(format!("{} frames of {} lines, and nothing is said to be lost", frames.len(), rows(&case.text())))
            }
            read => verdict(read),
        }
    })
}

pub(super) fn text() -> Target {
    target("text", "a.txt", seeds::text(), |case| {
        let mut source = match TextSource::from_bytes(case.bytes, &VendorOptions::default()) {
            Ok(source) => source,
            Err(e) => return verdict::<()>(Err(e)),
        };
        verdict(source.body())?;
        let understood = source.understood();
        let (frames, losses) = frames(&mut source).map_err(|e| e.to_string())?;
        let skipped: usize = losses.iter().filter_map(|loss| loss.split(' ').nth(1)?.parse::<usize>().ok()).sum();
        let cells = |line: &str| line.split([',', ';', ' ', '\t', '|']).all(|cell| cell.parse::<f64>().is_ok());
        let lines = case.text().split(['\n', '\r']).filter(|line| cells(line.trim())).count();
        let is_a_line_each =
            understood.starts_with("column") && !understood.contains(" lines ") && !understood.contains("is between");
        if is_a_line_each && frames.len() + skipped < lines {
            return Err(format!("{} frames and {skipped} skipped of {lines} lines: {understood}", frames.len()));
        }
        Ok(!frames.is_empty())
    })
}

pub(super) fn csv_skin() -> Target {
    target("csv_skin", "a.csv", [seeds::CSV_SKIN], |case| {
        let read = read_taxel_table(case.bytes, false);
        let flat = read_taxel_table(case.bytes, true);
        verdict(flat)?;
        match read {
            // A carriage return alone ends a row too.
            Ok(taxels) if taxels.len() + 1 > rows(&case.text().replace('\r', "\n")) => {
                Err(format!("{} taxels of fewer rows", taxels.len()))
            }
            read => verdict(read),
        }
    })
}

fn vendor(name: &'static str, file: &'static str, seeds: Vec<Vec<u8>>, options: VendorOptions) -> Target {
    target(name, file, seeds, move |case| {
        let read = VendorSource::open(case.path, &options).and_then(|mut source| {
            let _ = (source.body()?, source.calibration());
            frames(&mut source)
        });
        verdict(read)
    })
}

const KPA: Dialect = Dialect { unit: "kPa", ..PLAIN };

pub(super) fn xsensor() -> Target {
    let text = make::xsensor(&KPA, &["a-LF", "a-RF"], [4, 3], &[1, 2, 3]);
    vendor("xsensor", "a.csv", vec![text.into_bytes()], VendorOptions::default())
}

/// The layout of newer programs; and groups.
pub(super) fn xsensor_groups() -> Target {
    let seeds = vec![make::xsensor_groups(&[1, 2, 3]).into_bytes(), make::xsensor_newer(&[1, 2]).into_bytes()];
    vendor("xsensor_groups", "a.csv", seeds, VendorOptions::default())
}

pub(super) fn loadsol() -> Target {
    vendor(
        "loadsol",
        "a.txt",
        vec![make::loadsol(&["A12-L", "A12-R"], &[1, 2, 3]).into_bytes()],
        VendorOptions::default(),
    )
}

pub(super) fn footscan() -> Target {
    vendor(
        "footscan",
        "a.txt",
        vec![make::footscan(&["Left", "Right"], [4, 3], &[1, 2, 3]).into_bytes()],
        VendorOptions::default(),
    )
}

pub(super) fn stappone() -> Target {
    vendor("stappone", "a.csv", vec![make::stappone(&[1, 2], &[1, 2, 3]).into_bytes()], VendorOptions::default())
}

pub(super) fn tekscan() -> Target {
    vendor("tekscan", "a.asf", vec![make::tekscan(&KPA, [6, 10], &[1, 2, 3]).into_bytes()], VendorOptions::default())
}

pub(super) fn emed() -> Target {
    vendor("emed", "a.lst", vec![make::emed(&KPA, [5, 4], &[1, 2, 3], 1.0).into_bytes()], VendorOptions::default())
}

pub(super) fn pedar() -> Target {
    vendor("pedar", "a.asc", vec![make::novel(&KPA, &[5, 5], None, &[1, 2, 3]).into_bytes()], VendorOptions::default())
}

pub(super) fn pliance() -> Target {
    vendor(
        "pliance",
        "a.asc",
        vec![make::novel(&KPA, &[12], Some(4), &[1, 2, 3]).into_bytes()],
        VendorOptions::default(),
    )
}

pub(super) fn matrix() -> Target {
    let options = VendorOptions {
        format: Some(VendorFormat::Matrix),
        grid: Some([2, 2]),
        rate_hz: Some(1.0),
        ..VendorOptions::default()
    };
    vendor("matrix", "a.txt", vec![b"1,2\n3,4\n\n5,6\n7,8\n\n9,10\n11,12\n".to_vec()], options)
}

pub(super) fn insoles() -> Target {
    vendor("insoles", "a.csv", vec![file("examples/exports/insoles.csv")], VendorOptions::default())
}

/// All frames of a recording and what is lost, or why it is not read.
fn recorded(path: &std::path::Path) -> Result<Frames> {
    let mut reader = Reader::open(path)?;
    let attached = reader.attached().to_vec();
    for attached in &attached {
        reader.bytes_of(attached)?;
    }
    let mut frame = Frame::missing(0.0, reader.taxels().len());
    let mut frames = Vec::new();
    while frames.len() < MAX_FRAMES && reader.next_frame(&mut frame)? {
        frames.push((frame.t_s.to_bits(), frame.values.clone()));
    }
    Ok((frames, reader.losses()))
}

pub(super) fn mcap() -> Target {
    let sound = seeds::mcap();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.mcap"), &sound).unwrap();
    let (expected, losses) = recorded(&folder.path().join("a.mcap")).unwrap();
    assert!(expected.len() == 200 && losses.is_empty());
    target("mcap", "a.mcap", [sound], move |case| match recorded(case.path) {
        Ok((frames, losses)) if losses.is_empty() && frames != expected => {
            Err(format!("{} frames of {}, or other values, and nothing is said", frames.len(), expected.len()))
        }
        read => verdict(read),
    })
}

pub(super) fn bag_metadata() -> Target {
    let (metadata, mcap) = seeds::bag();
    target("bag_metadata", "metadata.yaml", [metadata], move |case| {
        let folder = case.path.parent().unwrap();
        let name = case.text();
        let named = name.split(['\n', ' ', '"']).find(|word| word.ends_with(".mcap") && !word.contains('/'));
        let file = folder.join(named.filter(|name| name.len() < 100).unwrap_or("bag_0.mcap"));
        if !file.exists() {
            // A name that no file can have is left to the parser.
            let _ = std::fs::write(&file, &mcap);
        }
        verdict(BagSurvey::read(folder, |_| {}))
    })
}

pub(super) fn bag() -> Target {
    let (_, sound) = seeds::bag();
    let count = |survey: &BagSurvey| survey.topics.iter().map(|topic| topic.messages).sum::<u64>();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.mcap"), &sound).unwrap();
    let expected = count(&BagSurvey::read(&folder.path().join("a.mcap"), |_| {}).unwrap());
    assert!(expected > 0);
    target("bag", "a.mcap", [sound], move |case| match BagSurvey::read(case.path, |_| {}) {
        Ok(survey) if survey.losses.is_empty() && count(&survey) < expected => {
            Err(format!("{} messages of {expected}, and nothing is said to be lost", count(&survey)))
        }
        read => verdict(read),
    })
}

/// SQLite has no checksums: what a damaged page says may be other messages, but nothing worse.
pub(super) fn bag_db3() -> Target {
    let body = Body::from_bytes("hand", bundled::HAND).unwrap();
    target("bag_db3", "a.db3", [seeds::bag_db3()], move |case| {
        let read = BagSource::open(&BagName::new(case.path), &body).and_then(|mut source| frames(&mut source));
        verdict(read)?;
        verdict(BagSurvey::read(case.path, |_| {}))
    })
}

pub(super) fn map() -> Target {
    target("map", "a.toml", [seeds::MAP, seeds::MAP_OF_SENSORS], |case| verdict(ArrayMap::parse(&case.text())))
}

pub(super) fn mapped_lines() -> Target {
    let maps = ["values = ['pads[*].p', 'digits']\ndecoder = 'u8'", "values = 'pads[*].p'\nnames = 'pads[*].n'"];
    let maps = maps.map(|map| ArrayMap::parse(map).unwrap());
    target("mapped_lines", "a.ndjson", [seeds::MAPPED_LINES, seeds::NAMED_LINES], move |case| {
        let read = |map: &ArrayMap| {
            let lines = JsonLines::open(case.path, map)?;
            let mut source = MappedSource::new(Box::new(lines), map, true)?;
            frames(&mut source)
        };
        Ok(verdict(read(&maps[0]))? | verdict(read(&maps[1]))?)
    })
}

fn message<M: Message + 'static>(name: &'static str, sound: Vec<u8>) -> Target {
    target(name, "a.cdr", [sound], |case| {
        let Some(message) = M::from_cdr(case.bytes) else { return Ok(false) };
        // What is taken can be written, and reads back as it is.
        let bytes = message.to_cdr();
        let again = M::from_cdr(&bytes).ok_or("what it writes does not read back")?;
        if again.to_cdr() != bytes {
            return Err("it reads back as another message".to_owned());
        }
        Ok(true)
    })
}

pub(super) fn point_cloud() -> Target {
    message::<PointCloud2>("point_cloud", seeds::point_cloud())
}

pub(super) fn joint_state() -> Target {
    message::<JointState>("joint_state", seeds::joint_state())
}

pub(super) fn transforms() -> Target {
    message::<TfMessage>("transforms", seeds::transforms())
}

pub(super) fn number_array() -> Target {
    message::<Float32MultiArray>("number_array", seeds::number_array())
}

/// A body that a parser lets in must stand what everybody asks of one.
fn used(body: &Body) -> Verdict {
    for link in 0..body.links.len().min(4) {
        let surface = body.surface_in_link(link);
        let _ = surface.nearest(glam::DVec3::new(0.01, 0.02, 0.03));
    }
    let _ = somatic::author::lint(body, &[]);
    match body.taxels.iter().find(|taxel| !(taxel.position_in_link.is_finite() && taxel.normal_in_link.is_finite())) {
        Some(taxel) => Err(format!("taxel {} is not at a place", taxel.id)),
        None => Ok(true),
    }
}

fn mesh(name: &'static str, file: &'static str, seeds: Vec<Vec<u8>>) -> Target {
    target(name, file, seeds, |case| {
        let opened = somatic::author::mesh::open(case.path, &MeshOptions::default());
        match opened.and_then(|file| file.read()) {
            Ok((body, _)) => used(&body),
            Err(e) => verdict::<()>(Err(e)),
        }
    })
}

pub(super) fn urdf() -> Target {
    target("urdf", "a.urdf", [seeds::URDF], |case| {
        if is_large(&case.text(), &["rows=\"", "cols=\""], 20_000) {
            return Ok(false);
        }
        let opened = somatic::author::mesh::open(case.path, &MeshOptions::default());
        let skin = author_urdf_skin(case.path, &MeshOptions::default());
        verdict(skin)?;
        match opened.and_then(|file| file.read()) {
            Ok((body, _)) => used(&body),
            Err(e) => verdict::<()>(Err(e)),
        }
    })
}

pub(super) fn urdf_joints() -> Target {
    let arm = file("examples/robots/arm.urdf");
    target("urdf_joints", "a.urdf", [arm, seeds::URDF.as_bytes().to_vec()], |case| {
        match Kinematics::from_urdf("a.urdf", &case.text()) {
            Ok(robot) => {
                let positions = vec![0.1; robot.joint_names().len()];
                Ok(!robot.link_poses(&positions).is_empty())
            }
            Err(e) => verdict::<()>(Err(e)),
        }
    })
}

pub(super) fn mjcf() -> Target {
    target("mjcf", "a.xml", [seeds::MJCF], |case| {
        // They get fields, charts and edges too.
        let (text, counts) = (case.text(), ["params=\"", "key=\"size\" value=\""]);
        if counts.iter().any(|mark| is_large(&text, &[mark], 2_000)) || text.matches("<tactile").count() > 500 {
            return Ok(false);
        }
        verdict(author_mjcf_skin(case.path, &MeshOptions::default()))
    })
}

pub(super) fn collada() -> Target {
    mesh("collada", "a.dae", vec![seeds::DAE.into()])
}

pub(super) fn stl() -> Target {
    mesh("stl", "a.stl", vec![seeds::STL.into(), seeds::binary_stl()])
}

pub(super) fn obj() -> Target {
    mesh("obj", "a.obj", vec![seeds::OBJ.into()])
}

pub(super) fn ply() -> Target {
    mesh("ply", "a.ply", vec![seeds::PLY.into(), seeds::binary_ply()])
}

fn body(name: &'static str, file: &'static str, seeds: Vec<Vec<u8>>) -> Target {
    target(name, file, seeds, |case| {
        // Authoring reads it in its own way.
        verdict(Original::from_bytes("a.glb", case.bytes, None).and_then(|file| file.read().map(|_| ())))?;
        match Body::from_bytes("a.glb", case.bytes) {
            Ok(body) => used(&body),
            Err(e) => verdict::<()>(Err(e)),
        }
    })
}

pub(super) fn glb() -> Target {
    body("glb", "a.glb", vec![seeds::glb()])
}

pub(super) fn gltf() -> Target {
    body("gltf", "a.gltf", vec![seeds::gltf()])
}

pub(super) fn body_extras() -> Target {
    // The JSON strings alone are damaged; the file around them is sound.
    let field = r#"{"version":1,"name":"arm/b","parent":"arm","chart":{"kind":"geodesic","origin":[0,0,0],"u":[1,0,0]},"members":{"1":[1,0,0],"2":[0.5,0.01,0]}}"#;
    let joint = r#"{"version":1,"name":"wrist","type":"revolute","axis":[0,0,1],"limits":[-1,1],"mimic":{"joint":"a","multiplier":2,"offset":0.1}}"#;
    let whole: serde_json::Value = serde_json::from_slice(&seeds::gltf()).unwrap();
    target("body_extras", "a.json", [field, joint], move |case| {
        let mut whole = whole.clone();
        let nodes = whole["nodes"].as_array_mut().ok_or("no nodes")?;
        let key = if case.sound.ends_with(b"}}") && !case.sound.starts_with(b"{\"version\":1,\"name\":\"wrist\"") {
            "somatic_field"
        } else {
            "somatic_joint"
        };
        let node = nodes.iter_mut().find(|node| node["extras"].get(key).is_some()).ok_or("no such node")?;
        node["extras"][key] = case.text().into();
        match Body::from_bytes("a.gltf", whole.to_string().as_bytes()) {
            Ok(body) => used(&body),
            Err(e) => verdict::<()>(Err(e)),
        }
    })
}

pub(super) fn icub() -> Target {
    target("icub", "a.txt", [seeds::ICUB], |case| match IcubFile::read(&case.text()) {
        Ok(file) => {
            let _ = (file.shared_places(), file.fields(0));
            let bytes = file.to_glb().to_bytes();
            match bytes.and_then(|bytes| Body::from_bytes("a", &bytes)) {
                Ok(body) if body.taxels.len() == file.taxels().count() => Ok(true),
                Ok(body) => Err(format!("{} taxels of {}", body.taxels.len(), file.taxels().count())),
                Err(e) => Err(format!("what it reads makes no body: {e}")),
            }
        }
        Err(e) => verdict::<()>(Err(e)),
    })
}

pub(super) fn recipe() -> Target {
    let seeds = [
        file("examples/recipes/hand.toml"),
        b"[[place]]\ntaxels = 50\n[[fields]]\nname = \"a\"\ntaxels = [3, \"10..=20\"]\n".to_vec(),
    ];
    target("recipe", "a.toml", seeds, |case| {
        verdict(Recipe::parse("a.toml", &case.text(), case.path.parent().unwrap()))
    })
}

pub(super) fn scene() -> Target {
    let example = String::from_utf8(file("examples/scenes/palm.toml")).unwrap();
    let touch = format!("csv:{}/bodies/touch.csv", seeds::ROOT);
    let example = example.replace("csv:../../bodies/touch.csv", &touch);
    target("scene", "a.toml", [example], |case| {
        program::verdict(&["run", case.path.to_str().unwrap(), "--sink", "ndjson:/dev/null"])
    })
}

pub(super) fn calibration() -> Target {
    let seeds = [seeds::CALIBRATION.as_bytes().to_vec(), file("examples/robots/arm-calibration.toml")];
    target("calibration", "a.toml", seeds, |case| {
        let ids: Vec<u32> = (0..200).collect();
        verdict(Calibration::parse(&case.text(), &ids))
    })
}

pub(super) fn wiring() -> Target {
    let seeds = [file("examples/wirings/hand.toml"), file("examples/wirings/hand-boards.toml")];
    target("wiring", "a.toml", seeds, |case| verdict(Wiring::from_text(&case.text())))
}

pub(super) fn simulation() -> Target {
    let beside = "rate_hz = 20\nduration_s = 1\n[layer]\nthickness_m = 0.005\n[temperature]\nambient_celsius = 20\n\
                  time_constant_s = 0.5\nnoise_sigma = 0.1\n[proximity]\nrange_m = 0.2\nnoise_sigma = 1\n[[touch]]\n\
                  on = \"hand/back\"\nindenter = \"ball\"\nradius_m = 0.008\npath = [[0, 0], [0, 0.01]]\nspeed_m_s = 0.02\n\
                  hold = { newton = 3 }\nfriction = 0.6\ntwist_deg = [[0, 0], [1, 20]]\ncelsius = 34\n\
                  gap_m = [[0, 0.1], [0.5, 0]]\n";
    target("simulation", "a.toml", [file("examples/simulations/press.toml"), beside.into()], |case| {
        let body = Body::from_bytes("hand", bundled::HAND).map_err(|e| e.to_string())?;
        verdict(SimulatedSource::on_body("a.toml", &case.text(), body))
    })
}

pub(super) fn board_line() -> Target {
    target("board_line", "a.bin", [seeds::line_of_a_board()], |case| {
        // Cut at any place it is the same.
        let read = |parts: &mut dyn Iterator<Item = &[u8]>| {
            let mut decoder = Decoder::new();
            let mut events = Vec::new();
            for part in parts {
                decoder.push(part, |event| {
                    events.push(match event {
                        Event::Frame { head, values, .. } => {
                            format!("{head:?} {:?}", values.iter().collect::<Vec<_>>())
                        }
                        other => format!("{other:?}"),
                    });
                });
            }
            (events, decoder.counts())
        };
        let whole = read(&mut std::iter::once(case.bytes));
        if read(&mut case.bytes.chunks(7)) != whole {
            return Err("in pieces it is another".to_owned());
        }
        let frames = whole.0.iter().filter(|event| event.starts_with("Head")).count();
        Ok(frames > 0)
    })
}

pub(super) fn http() -> Target {
    page("http", seeds::HTTP.as_bytes().to_vec())
}

pub(super) fn web_socket() -> Target {
    page("web_socket", seeds::web_socket())
}

fn page(name: &'static str, sound: Vec<u8>) -> Target {
    let page = Page::start();
    target(name, "a.bin", [sound], move |case| page.verdict(&page.meant(case.bytes)))
}

/// A name on the command line, a line.
fn names(
    name: &'static str,
    seeds: &'static [&'static str],
    check: impl Fn(&str) -> Verdict + Send + 'static,
) -> Target {
    target(name, "a.txt", seeds.iter().copied(), move |case| check(&case.text()))
}

pub(super) fn source_names() -> Target {
    let all: &[&str] = &[
        "csv:a.csv",
        "serial:/dev/ttyUSB0@115200",
        "mcap:a.mcap",
        "ros2-mcap:bag:/a,/b@sensor_msgs/msg/PointCloud2",
        "lerobot:a:touch#1",
        "sim:a.toml",
        "-",
        "csv:-",
    ];
    names("source_names", all, |text| verdict(text.parse::<SourceSpec>()))
}

pub(super) fn sink_names() -> Target {
    let all: &[&str] = &["ndjson:a.ndjson", "csv:a.csv", "mcap:a.mcap", "page:127.0.0.1:7879", "ros2-mcap:bag", "-"];
    names("sink_names", all, |text| verdict(text.parse::<SinkSpec>()))
}

fn sheet(text: &str, arguments: impl Fn(&str) -> Vec<String>) -> Verdict {
    // No argument holds a NUL.
    let text = text.replace('\0', "");
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let output = folder.path().join("a.glb").display().to_string();
    let arguments = [arguments(&text), vec!["-o".to_owned(), output]].concat();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    program::verdict(&[&["author"][..], &arguments].concat())
}

/// Whether `text` asks for at least `from` taxels, which take their time without optimisation, and for no more than are allowed. Their
/// number is the product of the numbers after each of `marks`, up to the quote that ends them; without marks, of all numbers.
fn is_large(text: &str, marks: &[&str], from: u64) -> bool {
    let numbers = |text: &str| -> Vec<u64> {
        text.split(|c: char| !c.is_ascii_digit()).filter_map(|digits| digits.parse().ok()).collect()
    };
    let after = |mark: &&str| text.split_once(*mark).and_then(|(_, rest)| rest.split('"').next());
    let numbers: Vec<u64> = match marks {
        [] => numbers(text),
        marks => marks.iter().filter_map(after).flat_map(numbers).collect::<Vec<u64>>(),
    };
    (from..=1_000_000).contains(&numbers.into_iter().fold(1, u64::saturating_mul))
}

pub(super) fn grid() -> Target {
    names("grid", &["31x11", "2x3", "8 X 8"], |text| {
        if is_large(text, &[], 20_000) {
            return Ok(false);
        }
        sheet(text, |grid| [&format!("--grid={grid}"), "--pitch", "8.6mm,5mm"].map(str::to_owned).to_vec())
    })
}

pub(super) fn regions() -> Target {
    names("regions", &["3x2", "1x1", "4x4"], |text| {
        sheet(text, |regions| {
            ["--grid", "8x8", "--pitch", "5mm", &format!("--regions={regions}")].map(str::to_owned).to_vec()
        })
    })
}

pub(super) fn joint_states() -> Target {
    let ndjson = "{\"t\":0,\"joints\":{\"a\":0.5,\"b\":1}}\n{\"t\":1,\"joints\":{\"a\":0.6}}\n";
    let seeds = [file("examples/robots/arm-joints.csv"), ndjson.as_bytes().to_vec()];
    target("joint_states", "a.csv", seeds, |case| {
        let states = JointStates::open(case.path);
        if let Ok(states) = &states {
            for joint in 0..states.joint_names().len().min(8) {
                let _ = states.at(joint, 0.55, joint % 2 == 0);
            }
        }
        verdict(states)
    })
}
