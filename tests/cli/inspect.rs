//! `somatic inspect`.

use glam::DVec3;
use serde_json::{Value, json};
use somatic::body::{FieldSpec, MemberSpec, Modality, Taxel};
use somatic::internal::body::{Glb, MeshData};

use super::{done, fails, file, output, text_of};

/// A body without taxels and fields.
const BARE: &str = r#"{"asset":{"version":"2.0"},"nodes":[{"name":"arm"}],"scenes":[{"nodes":[0]}]}"#;

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().unwrap().keys().map(String::as_str).collect()
}

#[test]
fn json_has_the_keys_that_others_lean_on() {
    let body: Value = serde_json::from_str(&done(&["inspect", "hand", "--json"])).unwrap();
    assert_eq!(keys(&body)[..3], ["links", "taxels", "fields"]);
    assert_eq!(body["links"], json!(["hand", "thumb", "index", "middle", "ring"]));
    let taxels = body["taxels"].as_array().unwrap();
    assert_eq!(taxels.len(), 40);
    for taxel in taxels {
        assert_eq!(keys(taxel), ["id", "link", "position", "normal", "area", "modality", "cell", "mean_normal"]);
        assert!(
            taxel["cell"].as_f64().unwrap() > taxel["area"].as_f64().unwrap(),
            "sensors are 5 mm wide, 12 mm apart: {taxel}"
        );
        let square =
            |key: &str| taxel[key].as_array().unwrap().iter().map(|it| it.as_f64().unwrap().powi(2)).sum::<f64>();
        assert!((square("mean_normal") - 1.0).abs() < 1e-9, "{taxel}");
        assert_eq!((taxel["position"].as_array().unwrap().len(), &taxel["modality"]), (3, &json!("pressure")));
    }
    let others =
        ["findings", "lint", "near_at_rest", "coverage", "cells", "edges", "islands", "without_edge", "few_edges"];
    assert_eq!(keys(&body)[3..], others);
    let [small] = &body["lint"].as_array().unwrap()[..] else { panic!("{}", body["lint"]) };
    assert_eq!(keys(small), ["kind", "taxels", "fields", "worst", "unit", "place", "links", "what"]);
    assert_eq!((&small["kind"], &small["fields"]), (&json!("small_field"), &json!(["hand/side"])));
    assert_eq!(body["findings"], json!([small["what"]]));
    assert_eq!(body["coverage"]["links"].as_array().unwrap().len(), 5);
    assert_eq!(keys(&body["coverage"]["holes"][0]), ["link", "position", "area"]);
    let (mut charted, mut chartless) = (0, 0);
    for field in body["fields"].as_array().unwrap() {
        assert_eq!(keys(field)[..5], ["name", "parent", "anchor", "members", "chart"]);
        let has_chart = !field["chart"].is_null();
        if has_chart {
            charted += 1;
            assert_eq!(keys(&field["chart"]), ["kind", "origin", "u", "v", "normal", "distortion", "distortion_rms"]);
            assert_eq!(field["chart"]["kind"], "plane");
        } else {
            chartless += 1;
            assert!(field["no_chart"].as_str().unwrap().contains("links"));
        }
        for member in field["members"].as_array().unwrap() {
            assert_eq!(keys(member), if has_chart { vec!["taxel", "weight", "uv"] } else { vec!["taxel", "weight"] });
        }
    }
    assert_eq!((charted, chartless), (11, 2));
}

#[test]
fn a_report_names_links_fields_and_why_a_chart_is_missing() {
    let text = done(&["inspect", "humanoid"]);
    for words in
        ["960", "coverage  99.", "├ left_upper_arm", "head/skull/front_2", "none: its taxels sit on 17 links", "plane"]
    {
        assert!(text.contains(words), "{words}: {text}");
    }
    assert!(!text.contains('\x1b'));
}

#[test]
fn findings_are_reported_and_count_only_where_that_is_asked_for() {
    let (_folder, path) = file("bare.gltf", BARE);
    let text = done(&["inspect", text_of(&path)]);
    assert!(text.contains("no taxels") && text.contains("no fields"), "{text}");
    let strict = output(&["inspect", text_of(&path), "--strict", "--json"]);
    assert_eq!(strict.status.code(), Some(1));
    let body: Value = serde_json::from_slice(&strict.stdout).unwrap();
    assert!(!body["findings"].as_array().unwrap().is_empty());
    assert_eq!((&body["taxels"], &body["fields"]), (&json!([]), &json!([])));
    assert!(fails(1, &["run", "--body", text_of(&path), "--source", "-"]).contains("no taxels"));

    assert_eq!(output(&["inspect", "mat", "--strict"]).status.code(), Some(0), "nothing is odd about the mat");
    assert!(done(&["inspect", "hand"]).contains("under 3 taxels, too few for orientation: hand/side"));
}

#[test]
fn a_file_goes_before_a_bundled_body_of_its_name() {
    let (folder, _) = file("hand", BARE);
    let output = super::somatic(&["inspect", "hand", "--json"]).current_dir(folder.path()).output().unwrap();
    let body: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(body["links"], json!(["arm"]));
}

#[test]
fn what_was_put_right_on_reading_is_reported_by_inspect_and_by_run() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("twice.glb");
    let taxel = |id: u32, x: f64| Taxel {
        id,
        link: 0,
        position_in_link: DVec3::X * x,
        normal_in_link: DVec3::Z,
        area: 1e-5,
        modality: Modality::Pressure,
        tangent_in_link: None,
    };
    let mut glb = Glb::new();
    let arm = glb.node("arm", None, DVec3::ZERO);
    glb.taxels("taxels", Some(arm), &[taxel(1, 0.0), taxel(2, 0.01), taxel(2, 0.02)], None);
    let members = [1, 2, 7].map(|id| (id, MemberSpec::default())).into();
    glb.field(&FieldSpec { name: "arm".into(), members, ..FieldSpec::default() }, Some(arm), DVec3::ZERO);
    glb.save(somatic::OutputPath::new(&path, false, &[]).unwrap()).unwrap();
    let reported = ["2 on link `arm` is now 3", "field `arm` names taxel 7"];

    let strict = output(&["inspect", text_of(&path), "--strict"]);
    assert_eq!(strict.status.code(), Some(1));
    let text = String::from_utf8(strict.stdout).unwrap();
    assert!(reported.iter().all(|words| text.contains(words)), "{text}");

    let (_recording, recording) = file("touch.csv", "t,1,2,3\n0,5,6,7\n");
    let run = output(&["run", "--body", text_of(&path), "--source", text_of(&recording), "--sink", "-"]);
    assert_eq!(run.status.code(), Some(0), "{}", super::stderr(&run));
    assert!(reported.iter().all(|words| super::stderr(&run).contains(words)), "{}", super::stderr(&run));
    let frame: Value = serde_json::from_slice(&run.stdout).unwrap();
    assert_eq!(frame["fields"][0]["total"], 11.0, "taxel 3 is in no field");
}

#[test]
fn kinds_of_taxels_are_not_added_up() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let place = |name: &str, first: u32, taxels: u32, kind: &str| {
        format!("[[place]]\nname = \"{name}\"\nfirst_id = {first}\ntaxels = {taxels}\nmodality = \"{kind}\"\n")
    };
    let recipe = place("skin", 0, 60, "force3") + &place("warm", 100, 20, "temperature");
    std::fs::write(at("kinds.toml"), recipe).unwrap();
    done(&["author", "mat", "--recipe", &at("kinds.toml"), "-o", &at("kinds.glb")]);
    let text = done(&["inspect", &at("kinds.glb")]);
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let line = |part: &str| *lines.iter().find(|line| line.contains(part)).unwrap_or_else(|| panic!("{part}: {text}"));
    let area = |line: &str| -> f64 {
        let (before, _) = line.split_once(" cm² of skin").unwrap_or_else(|| panic!("{line}"));
        before.rsplit(' ').next().unwrap().parse().unwrap()
    };
    let [pressed, warm] = ["feel forces,", "20 temperature, "].map(line);
    assert!(pressed.starts_with("taxels") && pressed.contains(" mm apart ("), "{pressed}");
    assert!((area(pressed) / area(warm) - 1.0).abs() < 0.01, "{pressed} {warm}");
    let plain = done(&["inspect", "mat"]);
    assert!(!plain.contains("feel forces") && plain.contains(" cm² of skin"), "{plain}");
}

/// The triangles of a cube of half side `side` about the origin, outside out or in.
fn cube(side: f32, is_inward: bool) -> MeshData {
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let turned = |[a, b, c]: [u32; 3]| if is_inward { [a, c, b] } else { [a, b, c] };
    MeshData {
        positions: (0..8_u32).map(|i| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { side } else { -side })).collect(),
        normals: vec![[0.0, 0.0, 1.0]; 8],
        triangles: faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).map(turned).collect(),
        skinning: None,
    }
}

#[test]
fn joints_of_a_urdf_uncover_taxels() {
    let folder = tempfile::tempdir().unwrap();
    let mut glb = Glb::new();
    let base = glb.node("base", None, DVec3::ZERO);
    let slider = glb.node("slider", Some(base), DVec3::ZERO);
    for (name, side, is_inward) in [("outside", 0.1, false), ("inside", 0.08, true)] {
        let wall = glb.node(name, Some(base), DVec3::ZERO);
        glb.mesh(wall, name, &cube(side, is_inward), None, None);
    }
    glb.mesh(slider, "slider", &cube(0.05, false), None, None);
    let taxel = Taxel {
        id: 7,
        link: 0,
        position_in_link: DVec3::new(0.0, 0.01, 0.05),
        normal_in_link: DVec3::Z,
        area: 1e-4,
        modality: Modality::Pressure,
        tangent_in_link: None,
    };
    glb.taxels("taxels", Some(slider), &[taxel], None);
    let body = folder.path().join("a.glb");
    glb.save(somatic::OutputPath::new(&body, false, &[]).unwrap()).unwrap();
    let urdf = r#"<robot name="r"><link name="base"/><link name="slider"/><joint name="j" type="prismatic"><parent link="base"/>
        <child link="slider"/><axis xyz="0 0 1"/><limit lower="0.5" upper="0.6"/></joint></robot>"#;
    let (_robot, urdf) = file("a.urdf", urdf);
    let urdf = text_of(&urdf);
    let kinds = |arguments: &[&str]| -> Vec<Value> {
        let all = [&["inspect", text_of(&body), "--json"], arguments].concat();
        let seen: Value = serde_json::from_str(&done(&all)).unwrap();
        let lint = seen["lint"].as_array().unwrap().iter();
        lint.filter(|finding| finding["kind"] != "no_fields").cloned().collect()
    };
    let [hidden] = &kinds(&[])[..] else { panic!("{:?}", kinds(&[])) };
    assert_eq!((&hidden["kind"], &hidden["taxels"]), (&json!("hidden_taxel"), &json!([7])));
    assert_eq!(hidden["links"], json!([{"link": "slider", "taxels": [7], "of": 1}]));
    assert_eq!(kinds(&["--joints", urdf, "--up", "y"]), Vec::<Value>::new());
    assert!(fails(1, &["inspect", text_of(&body), "--joints", urdf]).contains("with --up y they agree"));
    assert!(fails(2, &["inspect", text_of(&body), "--up", "y"]).contains("--joints"));
}
