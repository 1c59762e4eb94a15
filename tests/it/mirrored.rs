//! The same taxels on both sides of a body, with ids and fields in pairs; names of fields that say where they are.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use glam::DVec3;
use somatic::author::{Authored, Recipe, author};
use somatic::body::Body;
use somatic::bundled;
use somatic::internal::body::{MeshData, Original};

use crate::even::{block, body, made};

/// A box from `low` to `high`, m.
fn bar(low: [f64; 3], high: [f64; 3], n: u32) -> MeshData {
    block([low, high].map(DVec3::from_array), n, false)
}

/// A torso across the plane, which cuts squares of it, and two arms beside it.
fn figure() -> Original {
    body(&[
        ("torso", bar([-0.1, 0.0, -0.05], [0.1, 0.4, 0.05], 5)),
        ("left_arm", bar([0.15, 0.1, -0.03], [0.21, 0.4, 0.03], 3)),
        ("right_arm", bar([-0.21, 0.1, -0.03], [-0.15, 0.4, 0.03], 4)),
    ])
}

fn why(file: &Original, text: &str) -> String {
    let recipe = Recipe::parse("recipe.toml", text, Path::new("")).unwrap();
    let line = author(file.clone(), &recipe, |_| {}).unwrap_err().to_string();
    assert!(!line.contains('\n') && line.contains("`mirror`"), "{line}");
    line
}

/// `name` with left for right.
fn exchanged(name: &str) -> String {
    name.replace("left", "\0").replace("right", "left").replace('\0', "right")
}

/// The place and the normal of a taxel in the body.
fn in_body(body: &Body, id: u32) -> (DVec3, DVec3, usize) {
    let taxel = &body.taxels[body.taxel_index(id).unwrap()];
    let way = body.links[taxel.link].body_from_link;
    (way.transform_point3(taxel.position_in_link), way.transform_vector3(taxel.normal_in_link), taxel.link)
}

fn mirrored(v: DVec3) -> DVec3 {
    DVec3::new(-v.x, v.y, v.z)
}

/// That taxels are pairs of mirror images up to `within_m`, on links that are, with ids 2k and 2k + 1 after `first`.
fn are_pairs(body: &Body, first: u32, within_m: f64) {
    for id in (first..).step_by(2).take(body.taxels.len() / 2) {
        let ((left, left_normal, link), (right, right_normal, other)) = (in_body(body, id), in_body(body, id + 1));
        assert!(left.x > 0.0, "{id}: {left}");
        assert!(mirrored(left).distance(right) < within_m, "{id}: {left} {right}");
        assert!(mirrored(left_normal).dot(right_normal) > 0.7, "{id}: {left_normal} {right_normal}");
        assert_eq!(exchanged(&body.links[link].name), body.links[other].name);
    }
}

/// Checks that the mirror image of each field of up to `levels` levels is the field of the exchanged name.
fn fields_are_pairs(body: &Body, levels: usize) {
    let ids: BTreeMap<&str, BTreeSet<u32>> =
        body.fields.iter().map(|field| (field.name.as_str(), field.members.keys().copied().collect())).collect();
    for (name, own) in ids.iter().filter(|(name, _)| name.matches('/').count() < levels) {
        let images: BTreeSet<u32> = own.iter().map(|id| id ^ 1).collect();
        assert_eq!(ids.get(exchanged(name).as_str()), Some(&images), "{name} in {:?}", ids.keys());
    }
}

fn names(authored: &Authored) -> Vec<&str> {
    authored.body.fields.iter().map(|field| field.name.as_str()).collect()
}

#[test]
fn both_sides_get_the_same_taxels_in_pairs_of_ids_and_fields() {
    let authored = made(&figure(), "mirror = \"y\"\n[[place]]\ntaxels = 400");
    assert_eq!(authored.places[0].ids, Vec::from_iter(0..400));
    are_pairs(&authored.body, 0, 1e-6);
    let area = |side: usize| authored.body.taxels.iter().skip(side).step_by(2).map(|taxel| taxel.area).sum::<f64>();
    assert!((area(0) / area(1) - 1.0).abs() < 0.01, "{} {}", area(0), area(1));
    let [low, high] = authored.places[0].cell_spread.unwrap();
    assert!(low > 0.7 && high < 1.4, "{low} {high}");
    fields_are_pairs(&authored.body, 2);
    let below = |link: &str| names(&authored).into_iter().filter(|name| name.starts_with(&format!("{link}/"))).count();
    assert!(below("torso") > 8 && below("left_arm") > 2, "{:?}", names(&authored));
    // Patches of what is on both sides say which half they are on.
    let of_torso = names(&authored).into_iter().filter(|name| name.starts_with("torso/"));
    let has_half = |name: &str| name.contains("left") != name.contains("right");
    assert!(of_torso.clone().all(has_half), "{:?}", of_torso.collect::<Vec<_>>());
    // A patch of a mirrored link does not reach over the plane.
    for field in authored.body.fields.iter().filter(|field| field.name.contains('/')) {
        assert!(field.members.keys().all(|id| id % 2 == field.members.keys().next().unwrap() % 2), "{}", field.name);
    }
    assert!(authored.notes.iter().any(|note| note.contains("200 pairs")), "{:?}", authored.notes);
    // The same bytes again, and none of that without it.
    let again = made(&figure(), "mirror = \"y\"\n[[place]]\ntaxels = 400");
    assert_eq!(authored.file.to_glb().unwrap(), again.file.to_glb().unwrap());
    let plain = made(&figure(), "[[place]]\ntaxels = 400");
    let off = |id: u32| mirrored(in_body(&plain.body, id).0).distance(in_body(&plain.body, id + 1).0);
    assert!((0..400).step_by(2).any(|id| off(id) > 0.05));
}

#[test]
fn ids_begin_where_they_are_set_and_rules_make_pairs_too() {
    let text = "mirror = \"y\"\n[[place]]\ntaxels = 200\nfirst_id = 1000\n\
                [[fields]]\nname = \"left/arm\"\nlink = \"left_arm\"\npatches = { of = 9 }\nwrap = \"split\"\n\
                [[fields]]\nname = \"right/arm\"\nlink = \"right_arm\"\npatches = { of = 9 }\nwrap = \"split\"\n\
                [[fields]]\nname = \"torso\"\nlink = \"torso\"\nwrap = \"split\"";
    let authored = made(&figure(), text);
    are_pairs(&authored.body, 1000, 1e-6);
    fields_are_pairs(&authored.body, 3);
    assert!(authored.body.fields.len() > 10, "{:?}", names(&authored));
}

#[test]
fn a_skinned_body_is_mirrored_on_its_links() {
    let file = Original::from_bytes("humanoid", bundled::HUMANOID, None).unwrap();
    let authored = made(&file, "mirror = \"y\"\n[[place]]\ntaxels = 600");
    assert_eq!(authored.body.taxels.len(), 600);
    // The mesh is nearly symmetric: a tenth of the spacing is allowed.
    are_pairs(&authored.body, 0, 0.003);
    // A patch may have a chart on one side only, and is then split on the other.
    fields_are_pairs(&authored.body, 2);
    assert!(names(&authored).iter().any(|name| name.starts_with("left_forearm/")), "{:?}", names(&authored));
}

#[test]
fn what_cannot_be_mirrored_is_refused() {
    let file = figure();
    let odd = why(&file, "mirror = \"y\"\n[[place]]\ntaxels = 401");
    assert!(odd.contains("400 or 402"), "{odd}");
    for place in ["spacing = \"20 mm\"", "taxels = 40\nspacing = \"5 mm\"", "grid = \"hexagonal\"\npitch = \"10 mm\""] {
        let line = why(&file, &format!("mirror = \"y\"\n[[place]]\n{place}"));
        assert!(line.contains("number of `taxels`"), "{line}");
    }
    assert!(why(&file, "mirror = \"y\"\neven = false\n[[place]]\ntaxels = 40").contains("`even`"));
    let one_arm = body(&[
        ("torso", bar([-0.1, 0.0, -0.05], [0.1, 0.4, 0.05], 5)),
        ("left_arm", bar([0.15, 0.1, -0.03], [0.21, 0.4, 0.03], 3)),
    ]);
    let line = why(&one_arm, "mirror = \"y\"\n[[place]]\ntaxels = 100");
    assert!(line.contains("`left_arm`") && line.contains("no partner"), "{line}");
    let shifted = body(&[
        ("left_arm", bar([0.15, 0.1, -0.03], [0.21, 0.4, 0.03], 3)),
        ("right_arm", bar([-0.22, 0.1, -0.03], [-0.16, 0.4, 0.03], 3)),
    ]);
    let line = why(&shifted, "mirror = \"y\"\n[[place]]\ntaxels = 100");
    assert!(line.contains("`left_arm` lies up to 10.0 mm") && line.contains("`right_arm`"), "{line}");
    let right = body(&[("box", bar([-0.2, 0.0, 0.0], [-0.1, 0.1, 0.1], 2))]);
    assert!(why(&right, "mirror = \"y\"\n[[place]]\ntaxels = 10").contains("left of the plane"));
    let recipe = "mirror = \"x\"\n[[place]]\ntaxels = 10";
    assert!(Recipe::parse("recipe.toml", recipe, Path::new("")).unwrap_err().to_string().contains("line 1"));
}

#[test]
fn fields_are_named_by_side_and_links_without_prefix() {
    let file = body(&[
        ("mixamorig:LeftHand", bar([0.1, 0.0, 0.0], [0.3, 0.2, 0.2], 3)),
        ("mixamorig:RightHand", bar([-0.3, 0.0, 0.0], [-0.1, 0.2, 0.2], 3)),
        ("mixamorig:Head", bar([-0.1, 0.5, 0.0], [0.1, 0.7, 0.2], 3)),
    ]);
    let authored = made(&file, "[[place]]\ntaxels = 540");
    // A body faces +z, and its left is +x.
    let out = |hand: f64, side: &str| match side {
        "front" => DVec3::Z,
        "back" => DVec3::NEG_Z,
        "left" => DVec3::X,
        "right" => DVec3::NEG_X,
        "outer" => DVec3::X * hand,
        "inner" => DVec3::X * -hand,
        "top" => DVec3::Y,
        "bottom" => DVec3::NEG_Y,
        other => panic!("{other} in {:?}", names(&authored)),
    };
    let mut sides = BTreeSet::new();
    let mut last: BTreeMap<String, (u32, f64)> = BTreeMap::new();
    let mut patches: Vec<_> =
        authored.body.fields.iter().filter(|field| field.name.matches('/').count() == 1).collect();
    patches.sort_by(|a, b| a.name.cmp(&b.name));
    for field in patches {
        let all = field.members.keys().map(|&id| in_body(&authored.body, id));
        let (sum, normal) = all.fold((DVec3::ZERO, DVec3::ZERO), |(p, n), (at, normal, _)| (p + at, n + normal));
        let (link, place) = field.name.split_once('/').unwrap();
        let (side, number) = place.rsplit_once('_').unwrap();
        let hand = match link {
            "LeftHand" => 1.0,
            "RightHand" => -1.0,
            _ => 0.0,
        };
        let is_hand = hand != 0.0;
        assert!(!(is_hand && ["left", "right"].contains(&side)), "{}", field.name);
        assert!(is_hand || !["inner", "outer"].contains(&side), "{}", field.name);
        let most = normal.abs().max_element();
        assert!(normal.dot(out(hand, side)) > most - 1e-4, "{}: {normal}", field.name);
        sides.insert(side);
        // From top to bottom.
        let (number, height) = (number.parse::<u32>().unwrap(), sum.y / field.members.len() as f64);
        let (before, above) = last.insert(format!("{link}/{side}"), (number, height)).unwrap_or((0, f64::INFINITY));
        assert_eq!(number, before + 1, "{}", field.name);
        assert!(["top", "bottom"].contains(&side) || height < above + 2e-5, "{}: {height} {above}", field.name);
    }
    assert!(sides.len() >= 7 && last.len() > 12, "{sides:?}");
    // The link keeps its name.
    assert!(authored.body.link_index("mixamorig:LeftHand").is_some());
}
