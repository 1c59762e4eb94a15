//! Self-contacts, against a simulation in which both skins are pressed at a known place in the world.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use glam::DVec3;
use serde_json::Value;

use super::{done, fails, file, frames, stderr, text_of};

/// Two plates with skins of 10 mm pitch that face each other, 50 mm apart; `lift` brings the upper one down, `slide` aside.
const URDF: &str = r#"<robot name="plates">
  <link name="lower"/><link name="carriage"/><link name="upper"/>
  <joint name="lift" type="prismatic">
    <parent link="lower"/><child link="carriage"/><origin xyz="0 0 0.05"/><axis xyz="0 0 1"/>
    <limit lower="-0.05" upper="0" effort="1" velocity="1"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="carriage"/><child link="upper"/><axis xyz="1 0 0"/>
    <limit lower="-0.1" upper="0.1" effort="1" velocity="1"/>
  </joint>
  <sensor name="lower_skin"><parent link="lower"/><origin xyz="0 0 0"/>
    <tactile><array rows="8" cols="8" size="0.008 0.008" spacing="0.01 0.01"/></tactile></sensor>
  <sensor name="upper_skin"><parent link="upper"/><origin xyz="0 0.07 0" rpy="3.141592653589793 0 0"/>
    <tactile><array rows="8" cols="8" size="0.008 0.008" spacing="0.01 0.01"/></tactile></sensor>
</robot>"#;

/// Between the skins while they press on each other, m.
const LAYERS_M: f64 = 0.001;

/// What is simulated in a frame.
#[derive(Clone, Copy)]
pub(super) struct Truth {
    /// Where it presses, in the world of the URDF.
    pub(super) place: DVec3,
    lower: bool,
    upper: bool,
    pub(super) lift: f64,
    pub(super) slide: f64,
}

impl Truth {
    pub(super) fn is_contact(&self) -> bool {
        self.lower && self.upper && 0.05 + self.lift < 0.01
    }
}

/// The plates open, close, slide on each other, open while both are touched by others, and close on one that feels nothing.
pub(super) fn truth() -> Vec<Truth> {
    let at = |index: usize| {
        let along = f64::from(u32::try_from(index).unwrap());
        let closed = Truth {
            place: DVec3::new(0.025 + 0.001 * along, 0.035, LAYERS_M / 2.0),
            lower: true,
            upper: true,
            lift: LAYERS_M - 0.05,
            slide: 0.0013 * along,
        };
        match index {
            5..12 | 20..24 => closed,
            // Each is touched by something else.
            12..15 => Truth { lift: -0.01, ..closed },
            15..18 => Truth { upper: false, ..closed },
            _ => Truth { lower: false, upper: false, lift: 0.0, ..closed },
        }
    };
    (0..26).map(at).collect()
}

pub(super) struct Plates {
    _folder: tempfile::TempDir,
    urdf: PathBuf,
    body: PathBuf,
    /// Id, link and place in the link of each taxel.
    taxels: Vec<(u64, String, DVec3)>,
}

impl Plates {
    pub(super) fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (urdf, body) = (folder.path().join("plates.urdf"), folder.path().join("plates.glb"));
        std::fs::write(&urdf, URDF).unwrap();
        done(&["author", "--urdf-skin", text_of(&urdf), "-o", text_of(&body)]);
        let reported: Value = serde_json::from_str(&done(&["inspect", text_of(&body), "--json"])).unwrap();
        assert_eq!(reported["near_at_rest"], serde_json::json!([]));
        let taxel = |taxel: &Value| {
            let axis = |axis: usize| taxel["position"][axis].as_f64().unwrap();
            let link = taxel["link"].as_str().unwrap().to_owned();
            (taxel["id"].as_u64().unwrap(), link, DVec3::new(axis(0), axis(1), axis(2)))
        };
        let taxels: Vec<_> = reported["taxels"].as_array().unwrap().iter().map(taxel).collect();
        assert_eq!(taxels.len(), 128);
        Self { _folder: folder, urdf, body, taxels }
    }

    /// A frame for each of `truth`: a bump of pressure on each pressed skin; joint states are sent with `slide_off` (m).
    pub(super) fn lines(&self, truth: &[Truth], slide_off: f64) -> String {
        let line = |(index, truth): (usize, &Truth)| {
            let value = |(id, link, place): &(u64, String, DVec3)| {
                let (origin, pressed) = match link.as_str() {
                    "lower" => (DVec3::ZERO, truth.lower),
                    _ => (DVec3::new(truth.slide, 0.0, 0.05 + truth.lift), truth.upper),
                };
                // In the plane of the skin.
                let off = (origin + *place - truth.place).truncate();
                let value =
                    if pressed { 1000.0 * (-off.length_squared() / (2.0 * 0.008_f64.powi(2))).exp() } else { 0.0 };
                format!("\"{id}\":{}", if value < 1.0 { 0.0 } else { value })
            };
            let values: Vec<String> = self.taxels.iter().map(value).collect();
            format!(
                "{{\"t\":{},\"values\":{{{}}},\"joints\":{{\"lift\":{},\"slide\":{}}}}}\n",
                0.05 * f64::from(u32::try_from(index).unwrap()),
                values.join(","),
                truth.lift,
                truth.slide + slide_off
            )
        };
        truth.iter().enumerate().map(line).collect()
    }

    fn run(&self, lines: &str, flags: &[&str]) -> Vec<Value> {
        let (_folder, input) = file("frames.ndjson", lines);
        let outputs: &[&str] = if flags.contains(&"--outputs") { &[] } else { &["--outputs", "total,self_contacts"] };
        let run = Command::new(env!("CARGO_BIN_EXE_somatic"))
            .args(["run", "--body", text_of(&self.body), "--source", "-", "--backend", "cpu"])
            .args(outputs)
            .args(flags)
            .stdin(Stdio::from(std::fs::File::open(input).unwrap()))
            .output()
            .unwrap();
        assert!(run.status.success(), "{}", stderr(&run));
        frames(&String::from_utf8_lossy(&run.stdout))
    }

    /// The percepts of `lines` in their own links.
    pub(super) fn anchored(&self, lines: &str) -> Vec<Value> {
        self.run(lines, &["--outputs", "position", "--coordinates", "anchor"])
    }

    pub(super) fn jointed(&self, lines: &str, flags: &[&str]) -> Vec<Value> {
        self.run(lines, &[&["--joints", text_of(&self.urdf), "--up", "z"], flags].concat())
    }
}

fn self_contacts(frame: &Value) -> &[Value] {
    frame["self_contacts"].as_array().unwrap_or_else(|| panic!("{frame}"))
}

#[test]
fn contacts_are_there_exactly_when_both_skins_press_on_each_other() {
    let (plates, truth) = (Plates::new(), truth());
    let found = plates.jointed(&plates.lines(&truth, 0.0), &[]);
    assert_eq!(found.len(), truth.len());
    for (index, (frame, truth)) in found.iter().zip(&truth).enumerate() {
        let self_contacts = self_contacts(frame);
        assert_eq!(self_contacts.len(), usize::from(truth.is_contact()), "frame {index}: {frame}");
        let Some(contact) = self_contacts.first() else { continue };
        assert_eq!(contact["links"], serde_json::json!(["lower", "upper"]));
        // It is another contact after both touches have ended.
        assert_eq!(contact["id"], u64::from(index >= 20), "frame {index}");
        let number = |axis: usize| contact["position"][axis].as_f64().unwrap();
        let p = truth.place;
        let off = DVec3::new(number(0), number(1), number(2)).distance(p);
        assert!(off < 0.001, "frame {index}: {off} m off: {contact}");
        let (distance, angle) = (contact["distance"].as_f64().unwrap(), contact["angle"].as_f64().unwrap());
        assert!((distance - LAYERS_M).abs() < 0.001, "frame {index}: {contact}");
        assert!((angle - std::f64::consts::PI).abs() < 1e-6, "{contact}");
        for side in 0..2 {
            let touches = frame["touches"].as_array().unwrap();
            let touch = touches.iter().find(|touch| touch["id"] == contact["touches"][side]).unwrap();
            assert_eq!((&touch["link"], &touch["total"]), (&contact["links"][side], &contact["totals"][side]));
        }
    }
}

#[test]
fn poses_that_are_off_and_a_tolerance_that_is_too_small_give_no_contacts() {
    let (plates, truth) = (Plates::new(), truth());
    let any = |frames: &[Value]| frames.iter().any(|frame| !self_contacts(frame).is_empty());
    // By default 10 mm/√2 + 10 mm/√2 + 5 mm = 19.1 mm.
    assert!(any(&plates.jointed(&plates.lines(&truth, 0.017), &[])));
    assert!(!any(&plates.jointed(&plates.lines(&truth, 0.021), &[])));
    let lines = plates.lines(&truth, 0.0);
    assert!(any(&plates.jointed(&lines, &["--contact-tolerance", "3mm"])));
    assert!(!any(&plates.jointed(&lines, &["--contact-tolerance", "0.0005"])));
    // Far enough apart, two touches of others would pass for one.
    let open = &plates.jointed(&lines, &["--contact-tolerance", "0.05"])[13];
    assert_eq!(self_contacts(open).len(), 1);
}

#[test]
fn without_poses_contacts_are_absent() {
    let (plates, truth) = (Plates::new(), truth());
    let found = plates.run(&plates.lines(&truth, 0.0), &[]);
    for (frame, truth) in found.iter().zip(&truth) {
        assert_eq!(frame.get("self_contacts").is_some(), !(truth.lower || truth.upper), "{frame}");
        let touches = frame["touches"].as_array().unwrap();
        assert!(touches.iter().all(|touch| touch["in"] == touch["link"]), "{frame}");
    }
    assert!(
        fails(2, &["run", "--outputs", "self_contacts", "--coordinates", "anchor"]).contains("coordinates `anchor`")
    );
    assert!(fails(2, &["run", "--contact-tolerance", "0.01"]).contains("add them to --outputs"));
    assert!(fails(2, &["run", "--outputs", "self_contacts", "--contact-tolerance", "0"]).contains("metres over 0"));
}

#[test]
fn a_table_of_contacts_has_what_ndjson_has() {
    let (plates, truth) = (Plates::new(), truth());
    let folder = tempfile::tempdir().unwrap();
    let sink = folder.path().join("a.csv");
    let lines = plates.lines(&truth, 0.0);
    let reported = plates.jointed(&lines, &["--sink", text_of(&sink), "--sink", "-"]);
    let table = std::fs::read_to_string(folder.path().join("a.self_contacts.csv")).unwrap();
    let mut rows = table.lines();
    assert_eq!(
        rows.next().unwrap(),
        "t [s],frame,id,link_a,touch_a,total_a [count],link_b,touch_b,total_b [count],position_x [m],\
         position_y [m],position_z [m],distance [m],angle [rad]"
    );
    let row = |frame: &Value, contact: &Value| {
        let mut cells = vec![frame["t"].to_string(), frame["frame"].to_string(), contact["id"].to_string()];
        for side in 0..2 {
            cells.push(contact["links"][side].as_str().unwrap().to_owned());
            cells.extend(["touches", "totals"].map(|key| contact[key][side].to_string()));
        }
        cells.extend((0..3).map(|axis| contact["position"][axis].to_string()));
        cells.extend(["distance", "angle"].map(|key| contact[key].to_string()));
        cells.join(",")
    };
    let wanted: Vec<String> = reported.iter().flat_map(|f| self_contacts(f).iter().map(move |c| row(f, c))).collect();
    assert_eq!(rows.collect::<Vec<_>>(), wanted);
    assert_eq!(wanted.len(), 11);
    assert!(Path::new(&folder.path().join("a.touches.csv")).is_file());
    let described =
        done(&["run", "--describe", "--outputs", "self_contacts", "--sink", text_of(&folder.path().join("b.csv"))]);
    assert!(described.contains("one row per frame and self-contact") && described.contains("link_b"), "{described}");
}

#[test]
fn links_that_are_near_at_rest_are_reported() {
    let (folder, urdf) = file("plates.urdf", &URDF.replace("xyz=\"0 0 0.05\"", "xyz=\"0 0 0.015\""));
    let body = folder.path().join("near.glb");
    done(&["author", "--urdf-skin", text_of(&urdf), "-o", text_of(&body)]);
    let near = |flags: &[&str]| {
        let reported = done(&[&["inspect", text_of(&body), "--json"], flags].concat());
        serde_json::from_str::<Value>(&reported).unwrap()["near_at_rest"].clone()
    };
    let reported = near(&[]);
    assert_eq!(reported[0]["links"], serde_json::json!(["lower", "upper"]));
    assert!((reported[0]["nearest"].as_f64().unwrap() - 0.015).abs() < 1e-6, "{reported}");
    assert!((reported[0]["tolerance"].as_f64().unwrap() - (0.005 + 0.02 / 2.0_f64.sqrt())).abs() < 1e-6, "{reported}");
    // Each taxel faces the one above it and the four beside that.
    assert_eq!(reported[0]["taxels"][0].as_array().unwrap().len(), 64);
    assert_eq!(reported[0]["facing"], 64 + 4 * 56);
    assert_eq!(near(&["--contact-tolerance", "0.0149"]), serde_json::json!([]));
    assert!(done(&["inspect", text_of(&body)]).contains("near at rest"));
}
