//! Pictures of bodies with taxels of several kinds: from where they are seen, how large they are, and which lies above.

use somatic::internal::colours::temperature_colours;

use super::senses::{count, drawn};
use super::{done, text_of};

#[test]
fn a_letter_with_nothing_to_see_is_drawn_from_where_its_taxels_are_seen() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    // They look up, and from the front and the back are seen edge on.
    let row = |kind: &str, id: i32| format!("{id},pad,{},0,0,0,1,0,1.6e-5,{kind}\n", 0.005 * f64::from(id));
    let rows: String = (0..6).map(|id| row(if id < 3 { "pressure" } else { "proximity" }, id)).collect();
    std::fs::write(at("skin.csv"), format!("id,link,x,y,z,nx,ny,nz,area,modality\n{rows}")).unwrap();
    std::fs::write(at("fields.toml"), "[[fields]]\nname = \"pad\"\ntaxels = [\"0..=5\"]\n").unwrap();
    std::fs::write(at("far.toml"), "[proximity]\nunit = \"mm\"\nrange = 80\n").unwrap();
    std::fs::write(at("far.csv"), "t,0,1,2,3,4,5\n0,0,0,0,200,200,200\n").unwrap();
    let (skin, bare, body) = (at("skin.csv"), at("bare.glb"), at("pad.glb"));
    done(&["author", "--csv-skin", text_of(&skin), "-o", text_of(&bare)]);
    done(&["author", text_of(&bare), "--recipe", text_of(&at("fields.toml")), "-o", text_of(&body)]);
    let [source, calibration] = ["far.csv", "far.toml"].map(at);
    for letter in ["pressure", "proximity"] {
        let to = at("a.png");
        let from = ["render", text_of(&body), "--source", text_of(&source), "--calibration", text_of(&calibration)];
        let how = ["--letter", letter, "--size", "600", "-o", text_of(&to), "--force"];
        let Some(picture) = drawn(&[&from[..], &how].concat(), &to) else { return };
        assert!(count(&picture, [0xD6, 0xD6, 0xD4]) > 1000, "{letter}");
    }
}

/// Two thermistors 5 mm apart, each 0.4 mm beside a pressure taxel, and a third one at the place of a pressure taxel.
fn mixed_pad() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let row = |id: i32, x: f64, kind: &str| format!("{id},pad,{x},0,0,0,0,1,1.6e-5,{kind}\n");
    let pressed = (0..3).map(|n| row(n, 0.005 * f64::from(n), "pressure")).collect::<String>();
    let warm = [0.0004, 0.0054, 0.01].iter().zip(10..).map(|(x, id)| row(id, *x, "temperature")).collect::<String>();
    std::fs::write(at("skin.csv"), format!("id,link,x,y,z,nx,ny,nz,area,modality\n{pressed}{warm}")).unwrap();
    std::fs::write(at("fields.toml"), "[[fields]]\nname = \"pad\"\ntaxels = [\"0..=12\"]\n").unwrap();
    std::fs::write(at("warm.csv"), "t,0,1,2,10,11,12\n0,0,0,0,20,30,40\n").unwrap();
    let calibration = "[all]\nunit = \"N\"\np_max = 1\n[temperature]\nraw_range = [20, 40]\n";
    std::fs::write(at("warm.toml"), calibration).unwrap();
    done(&["author", "--csv-skin", text_of(&at("skin.csv")), "-o", text_of(&at("bare.glb"))]);
    let [bare, recipe, body] = ["bare.glb", "fields.toml", "pad.glb"].map(at);
    done(&["author", text_of(&bare), "--recipe", text_of(&recipe), "-o", text_of(&body)]);
    folder
}

#[test]
fn taxels_are_as_large_as_those_of_their_letter_leave_room_for_and_lie_above_others() {
    let folder = mixed_pad();
    let at = |name: &str| folder.path().join(name);
    let [body, source, calibration, to] = ["pad.glb", "warm.csv", "warm.toml", "a.png"].map(at);
    let picture = |more: &[&str]| {
        let from = ["render", text_of(&body), "--source", text_of(&source), "--calibration", text_of(&calibration)];
        let how = ["--size", "600", "-o", text_of(&to), "--force"];
        drawn(&[&from[..], &how, more].concat(), &to)
    };
    for drawing in [["--view", "front"], ["--uv", "pad"]] {
        let Some(warm) = picture(&[&drawing[..], &["--letter", "temperature"]].concat()) else { return };
        // Of thermistors that had 0.16 mm for the pressure taxel beside them, and of 2 mm now.
        let map = temperature_colours();
        for colour in [map[0], map[128], map[255]] {
            assert!(count(&warm, colour) > 4000, "{drawing:?}: {}", count(&warm, colour));
        }
        // Pressure taxels cover the thermistor that has their place, and nothing is pressed: all of it is grey.
        let pressed = picture(&[&drawing[..], &["--letter", "pressure"]].concat()).unwrap();
        assert!(count(&pressed, [0xD6, 0xD6, 0xD4]) > 3 * 4000, "{drawing:?}");
    }
}
