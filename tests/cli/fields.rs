//! Fields of a recipe, and the iCub's position files, from the command line.

use std::path::Path;

use serde_json::Value;

use crate::{done, fails, file, text_of};

/// Authors on `mesh` by the recipe `text`, and gives what was said and how `inspect` sees it.
fn author(mesh: &str, text: &str) -> (Value, Value) {
    let (folder, recipe) = file("recipe.toml", text);
    let body = folder.path().join("body.glb");
    let said = done(&["author", mesh, "--recipe", text_of(&recipe), "-o", text_of(&body), "--json"]);
    let seen = done(&["inspect", text_of(&body), "--json"]);
    (serde_json::from_str(&said).unwrap(), serde_json::from_str(&seen).unwrap())
}

fn refused(mesh: &str, text: &str) -> String {
    let (folder, recipe) = file("recipe.toml", text);
    let body = folder.path().join("body.glb");
    let why = fails(1, &["author", mesh, "--recipe", text_of(&recipe), "-o", text_of(&body)]);
    assert!(!body.exists() && why.trim().lines().count() == 1, "{why}");
    why
}

fn names(seen: &Value) -> Vec<&str> {
    seen["fields"].as_array().unwrap().iter().map(|field| field["name"].as_str().unwrap()).collect()
}

#[test]
fn a_recipe_groups_what_it_places() {
    let text = r#"
        [[place]]
        taxels = 200
        [[fields]]
        name = "left_arm/forearm"
        link = "left_forearm"
        patches = 2
        wrap = "split"
        [[fields]]
        within = "left_arm/forearm/*"
        name = "spot"
        seeds = "left_arm/forearm/*"
        radius = "15 mm"
        chart = "plane"
        wrap = "bare"
    "#;
    let (_, seen) = author("humanoid", text);
    let names = names(&seen);
    let below = |name: &&&str| name.starts_with("left_arm/forearm/") && name.matches('/').count() == 2;
    let patches: Vec<&&str> = names.iter().filter(below).collect();
    let [one, other] = patches[..] else { panic!("{names:?}") };
    for side in [one, other].map(|name| name.rsplit('/').next().unwrap()) {
        let words = ["front", "back", "inner", "outer", "top", "bottom", "around"];
        assert!(words.iter().any(|word| side == format!("{word}_1") || side == format!("{word}_2")), "{side}");
    }
    assert!(names.contains(&"left_arm") && names.contains(&"left_arm/forearm"), "{names:?}");
    let find = |name: &str| seen["fields"].as_array().unwrap().iter().find(|field| field["name"] == name).unwrap();
    assert_eq!(find(other)["parent"], "left_arm/forearm");
    assert_eq!(find("left_arm/forearm")["anchor"], "left_forearm");
    // Everything of the forearm is in one of its patches.
    let members = |name: &str| find(name)["members"].as_array().unwrap().len();
    let whole = members("left_arm/forearm");
    assert_eq!(members(one) + members(other), whole);
    // Each leaf that holds the forearm's skin has a chart, or was split into some that have.
    let has_children = |name: &str| names.iter().any(|other| other.starts_with(&format!("{name}/")));
    let is_part = |name: &&&str| name.starts_with("left_arm/forearm/") && name.matches('/').count() == 3;
    let leaves = names.iter().filter(is_part).filter(|name| !name.contains("/spot") && !has_children(name));
    for leaf in leaves {
        assert!(find(leaf)["chart"].is_object(), "{leaf}");
    }
}

#[test]
fn a_wrong_rule_is_named_with_its_line() {
    let place = "[[place]]\ntaxels = 50\n";
    let why = refused("hand", &format!("{place}[[fields]]\nname = \"a\"\nlink = \"plam\"\n"));
    assert!(why.contains("recipe.toml: line 3") && why.contains("`plam`"), "{why}");
    let why = refused("hand", &format!("{place}[[fields]]\nname = \"a\"\npatchs = 3\n"));
    assert!(why.contains("line 5") && why.contains("did you mean `patches`?"), "{why}");
    let text = "[[place]]\ntaxels = 500\n[[fields]]\nname = \"a\"\n[[fields]]\nname = \"arm\"\nlink = \"left_forearm\"\n\
                chart = \"plane\"\n";
    let why = refused("humanoid", text);
    assert!(why.contains("line 5") && why.contains("field `arm`") && why.contains("wrap = \"split\""), "{why}");
}

#[test]
fn an_icub_file_is_put_on_a_link() {
    // Three taxels over the mat, one absent row, one thermal pad.
    let positions = "name mat\ntaxel2Repr (0 0 -1 -2 0)\n[calibration]\n0.1 0.001 0.1 0 1 0\n0.12 0.001 0.1 0 1 0\n\
                     0 0 0 0 0 0\n0.14 0.001 0.1 0 1 0\n0.1 0.001 0.12 0 1 0\n";
    let (folder, path) = file("skin.txt", positions);
    let recipe = folder.path().join("recipe.toml");
    let run = |text: &str, code: i32| {
        std::fs::write(&recipe, text).unwrap();
        let body = folder.path().join("body.glb");
        let arguments = ["author", "mat", "--recipe", text_of(&recipe), "-o", text_of(&body), "--force", "--json"];
        if code != 0 {
            return (Value::Null, fails(code, &arguments));
        }
        let said = done(&arguments);
        (serde_json::from_str(&done(&["inspect", text_of(&body), "--json"])).unwrap(), said)
    };
    let (seen, said) = run("[[place]]\nicub = \"skin.txt\"\nlink = \"mat\"\nfirst_id = 100\nwithin = \"1 m\"\n", 0);
    let ids: Vec<u64> = seen["taxels"].as_array().unwrap().iter().map(|taxel| taxel["id"].as_u64().unwrap()).collect();
    assert_eq!(ids, [100, 101, 104]);
    assert!(said.contains("thermal pads") && said.contains("absent"), "{said}");
    let (seen, _) = run("[[place]]\nicub = \"skin.txt\"\nwithin = \"1 m\"\nmodality = \"temperature\"\n", 0);
    assert_eq!(seen["taxels"][0]["modality"], "temperature");
    let (_, why) = run("[[place]]\nicub = \"skin.txt\"\nlink = \"maat\"\n", 1);
    assert!(why.contains("line") && why.contains("did you mean `mat`?"), "{why}");
    let (_, why) = run("[[place]]\nicub = \"skn.txt\"\n", 1);
    assert!(why.contains("skn.txt"), "{why}");
    assert!(Path::new(&path).exists());
}
