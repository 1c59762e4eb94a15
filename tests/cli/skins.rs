//! Skins from one kind of file to another: every taxel comes back.

use std::path::Path;

use serde_json::Value;
use somatic::Body;
use somatic::body::Link;

use super::{done, fails, files_in, output, stderr, text_of};

/// What is known of a taxel: its id, its link, and its place, normal and area.
type Known = (u64, String, Vec<f64>);

/// The taxels of a body: by ascending id, the link, and place, normal and area.
fn taxels(body: &str) -> Vec<Known> {
    let known: Value = serde_json::from_str(&done(&["inspect", body, "--json"])).unwrap();
    let numbers = |value: &Value| value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect::<Vec<_>>();
    let taxel = |taxel: &Value| {
        let mut all = numbers(&taxel["position"]);
        all.extend(numbers(&taxel["normal"]));
        all.push(taxel["area"].as_f64().unwrap_or(0.0));
        (taxel["id"].as_u64().unwrap(), taxel["link"].as_str().unwrap().to_owned(), all)
    };
    known["taxels"].as_array().unwrap().iter().map(taxel).collect()
}

/// How many of `back` are `original`'s: the same id and link, and the numbers as single precision holds them.
fn same(original: &[Known], back: &[Known]) -> usize {
    // A body's own numbers are single; a transform or two may round them once more.
    let near = |a: f64, b: f64| (a - b).abs() <= 4.0 * f64::from(f32::EPSILON) * a.abs().max(b.abs()).max(0.1);
    let is_same =
        |(a, b): &(&Known, &Known)| (a.0, &a.1) == (b.0, &b.1) && a.2.iter().zip(&b.2).all(|(a, b)| near(*a, *b));
    original.iter().zip(back).filter(is_same).count()
}

#[test]
fn every_taxel_comes_back_from_a_table_and_from_a_urdf() {
    for (body, count) in [("hand", 40), ("mat", 2048), ("humanoid", 960)] {
        let original = taxels(body);
        assert_eq!(original.len(), count);
        let folder = tempfile::tempdir().unwrap();
        for (ending, flag) in [("csv", "--csv-skin"), ("urdf", "--urdf-skin")] {
            let there = folder.path().join(format!("skin.{ending}"));
            let back = folder.path().join(format!("{ending}.glb"));
            done(&["convert", body, "-o", text_of(&there)]);
            done(&["author", flag, text_of(&there), "-o", text_of(&back)]);
            let back = taxels(text_of(&back));
            assert_eq!((back.len(), same(&original, &back)), (count, count), "{body}, {ending}");
            // What is elsewhere is seen.
            let mut moved = back.clone();
            moved[count / 2].2[0] += 1e-6;
            moved[0].1 += "x";
            assert_eq!(same(&original, &moved), count - 2);
        }
    }
}

#[test]
fn what_a_urdf_has_no_place_for_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let there = folder.path().join("skin.urdf");
    let said = stderr(&output(&["convert", "sensing-hand", "-o", text_of(&there)]));
    assert!(said.contains("29 taxels have three axes, for two of which a URDF has no place"), "{said}");
    assert!(said.contains("taxels measure something else than pressure"), "{said}");
    let plain = stderr(&output(&["convert", "hand", "-o", text_of(&folder.path().join("hand.urdf"))]));
    assert!(!plain.contains("three axes"), "{plain}");
}

#[test]
fn what_taxels_measure_and_their_tangents_come_back_from_a_table() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let rows = "1,pad,0,0,0,0,0,1,0.0001,force3,0,1,0\n2,pad,0.01,0,0,0,0,1,0.0001,temperature,,,\n";
    let table = format!("id,link,x,y,z,nx,ny,nz,area,modality,tx,ty,tz\n{rows}");
    std::fs::write(at("skin.csv"), &table).unwrap();
    done(&["author", "--csv-skin", text_of(&at("skin.csv")), "-o", text_of(&at("skin.glb"))]);
    let body = Body::load(at("skin.glb")).unwrap();
    assert_eq!(body.taxels[0].tangent_in_link, Some(glam::DVec3::Y));
    done(&["convert", text_of(&at("skin.glb")), text_of(&at("back.csv"))]);
    let back = std::fs::read_to_string(at("back.csv")).unwrap();
    let numbers = |text: &str| -> Vec<String> {
        // An area is of single precision.
        let cell = |cell: &str| cell.parse().map_or_else(|_| cell.to_owned(), |x: f64| format!("{x:.6}"));
        text.split([',', '\n']).map(cell).collect()
    };
    assert_eq!(numbers(&back), numbers(&table));
    // Without a tangent there is no column for it.
    done(&["convert", "hand", text_of(&at("hand.csv"))]);
    let hand = std::fs::read_to_string(at("hand.csv")).unwrap();
    assert!(hand.starts_with("id,link,x,y,z,nx,ny,nz,area,modality\n"), "{}", hand.lines().next().unwrap());
}

#[test]
fn links_of_a_urdf_stand_where_those_of_the_body_do() {
    let folder = tempfile::tempdir().unwrap();
    let (urdf, back) = (folder.path().join("a.urdf"), folder.path().join("a.glb"));
    done(&["convert", "humanoid", text_of(&urdf)]);
    done(&["author", "--urdf-skin", text_of(&urdf), "-o", text_of(&back)]);
    let (before, after) =
        (Body::from_bytes("humanoid", somatic::bundled::HUMANOID).unwrap(), Body::load(&back).unwrap());
    for link in &before.links {
        let same = &after.links[after.link_index(&link.name).expect("it is there")];
        let parent = |body: &Body, link: &Link| link.parent.map(|parent| body.links[parent].name.clone());
        let parents = (parent(&before, link), parent(&after, same).filter(|name| name != "base"));
        assert_eq!(parents.0, parents.1, "{}", link.name);
        assert!(link.body_from_link.abs_diff_eq(same.body_from_link, 1e-6), "{}", link.name);
    }
    assert!(before.links.len() > 10 && after.links.len() <= before.links.len() + 1);
}

#[test]
fn a_table_puts_the_taxels_back_on_their_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    done(&["convert", "hand", "-o", text_of(&at("hand.csv"))]);
    std::fs::write(at("back.toml"), "[[place]]\ncsv = \"hand.csv\"\n").unwrap();
    done(&["author", "hand", "--recipe", text_of(&at("back.toml")), "-o", text_of(&at("back.glb"))]);
    let (original, back) = (taxels("hand"), taxels(text_of(&at("back.glb"))));
    let ids = |taxels: &[Known]| taxels.iter().map(|taxel| taxel.0).collect::<Vec<_>>();
    assert_eq!(ids(&original), ids(&back));
    for (a, b) in original.iter().zip(&back) {
        assert!(a.2[..3].iter().zip(&b.2).all(|(a, b)| (a - b).abs() < 1e-6), "{a:?} {b:?}");
    }
}

#[test]
fn what_cannot_be_converted_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    assert!(fails(2, &["convert", "hand", "-o", &at("hand.mcap")]).contains("becomes a .csv or a .urdf"));
    assert!(fails(2, &["convert", "hand"]).contains("OUT"));
    assert!(
        fails(2, &["convert", "hand", &at("a.csv"), "--rate", "5"])
            .contains("without the flags for recordings; leave them out")
    );
    let table = at("hand.csv");
    let said = stderr(&output(&["convert", "hand", "-o", &table]));
    assert!(said.contains("40 taxels in") && said.contains("fields left out"), "{said}");
    assert!(fails(1, &["convert", "hand", "-o", &table]).contains("--force"));
    std::fs::write(&table, "id,x,y,z\n1,0,0,0\n").unwrap();
    let why = fails(1, &["author", "--csv-skin", &table, "-o", &at("a.glb")]);
    assert!(why.contains("hand.csv: line 2: taxel 1: it has no normal") && why.lines().count() == 1, "{why}");
    assert_eq!(files_in(folder.path()), ["hand.csv"]);
    assert!(Path::new(&table).exists());
}

#[test]
fn taxels_of_every_kind_are_in_a_field_of_their_place() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    // 40 by 5 pressure taxels, 5 mm apart, and a thermometer beside each tenth one.
    let mut table = "id,link,x,y,z,nx,ny,nz,area,modality\n".to_owned();
    let place = |i: u32| [0.005 * f64::from(i % 40), 0.005 * f64::from(i / 40)];
    for i in 0..200_u32 {
        let [x, y] = place(i);
        table += &format!("{i},skin,{x},{y},0,0,0,1,2.5e-5,pressure\n");
        if i % 10 == 0 {
            table += &format!("{},skin,{},{y},0,0,0,1,2.5e-5,temperature\n", 1000 + i, x + 0.001);
        }
    }
    std::fs::write(at("skin.csv"), table).unwrap();
    done(&["author", "--csv-skin", text_of(&at("skin.csv")), "-o", text_of(&at("skin.glb"))]);
    let body = Body::load(at("skin.glb")).unwrap();
    let patches: Vec<_> = body.fields.iter().filter(|field| !field.members.is_empty()).collect();
    assert!(patches.len() > 10, "{}", patches.len());
    for i in (0..200).step_by(10) {
        let holds = |id: u32| patches.iter().position(|patch| patch.members.contains_key(&id));
        assert!(holds(1000 + i).is_some() && holds(1000 + i) == holds(i), "thermometer {} is not beside {i}", 1000 + i);
    }
}
