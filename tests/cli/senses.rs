//! Shear, temperature and proximity in plots and pictures.

use std::path::{Path, PathBuf};

use somatic::internal::colours::{distance_colours, pressure_colours, temperature_colours};
use somatic_testing::skip;

use super::{done, fails, output, stderr, text_of};

/// A skin with two taxels of each kind, its calibration and a recording: pressed and pulled along y, warmer from second to second,
/// with something that comes nearer to the first proximity taxel, and nothing near the second.
struct Skin {
    folder: tempfile::TempDir,
}

impl Skin {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let kinds = [("force3", "0,1,0"), ("temperature", ",,"), ("proximity", ",,")];
        let rows = kinds.into_iter().enumerate().flat_map(|(kind, (name, tangent))| {
            (0..2).map(move |n| {
                format!(
                    "{},pad,{},{},0,0,0,1,1.6e-5,{name},{tangent}\n",
                    10 * kind + n,
                    0.01 * kind as f64,
                    0.005 * n as f64
                )
            })
        });
        let rows: String = rows.collect();
        std::fs::write(at("skin.csv"), format!("id,link,x,y,z,nx,ny,nz,area,modality,tx,ty,tz\n{rows}")).unwrap();
        std::fs::write(at("fields.toml"), "[[fields]]\nname = \"pad\"\ntaxels = [\"0..=99\"]\n").unwrap();
        let calibration = "[all]\nunit = \"N\"\np_max = 0.4\n[temperature]\nraw_range = [0, 50]\n[proximity]\nunit = \"mm\"\nrange = 80\n";
        std::fs::write(at("senses.toml"), calibration).unwrap();
        let frames: String = (0..21)
            .map(|n| f64::from(n) * 0.1)
            .map(|t| format!("{t},0.4,0.2,{},{},{},200,0.2,0.1,0,0\n", 20.0 + 5.0 * t, 30.0 + 5.0 * t, 60.0 - 20.0 * t))
            .collect();
        std::fs::write(at("touch.csv"), format!("t,0,1,10,11,20,21,0.u,1.u,0.v,1.v\n{frames}")).unwrap();
        done(&["author", "--csv-skin", text_of(&at("skin.csv")), "-o", text_of(&at("bare.glb"))]);
        done(&[
            "author",
            text_of(&at("bare.glb")),
            "--recipe",
            text_of(&at("fields.toml")),
            "-o",
            text_of(&at("pad.glb")),
        ]);
        Self { folder }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn plot(&self, outputs: &str) -> Vec<String> {
        let [body, calibration, touch, to] = ["pad.glb", "senses.toml", "touch.csv", "a.svg"].map(|name| self.at(name));
        let from = ["plot", text_of(&touch), "--body", text_of(&body), "--calibration", text_of(&calibration)];
        done(&[&from[..], &["--outputs", outputs, "-o", text_of(&to), "--force"]].concat());
        let svg = std::fs::read_to_string(&to).unwrap();
        svg.lines().map(str::to_owned).collect()
    }

    /// The colours of a picture, or none where no adapter answers.
    fn render(&self, letter: &[&str]) -> Option<Vec<[u8; 3]>> {
        let [body, calibration, touch, to] = ["pad.glb", "senses.toml", "touch.csv", "a.png"].map(|name| self.at(name));
        let from = ["render", text_of(&body), "--source", text_of(&touch), "--calibration", text_of(&calibration)];
        let how = ["--at", "2s", "--view", "front", "--size", "900", "-o", text_of(&to), "--force"];
        let output = output(&[&from[..], &how, letter].concat());
        let said = stderr(&output);
        if said.contains("no GPU driver answers") {
            skip("GPU", "no adapter answers");
            return None;
        }
        assert_eq!((output.status.code(), said.as_str()), (Some(0), ""));
        Some(pixels(&to))
    }
}

fn pixels(path: &Path) -> Vec<[u8; 3]> {
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    bytes.chunks_exact(3).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
}

/// Pixels of a colour, as near as an adapter rounds: of discs, which are flat, and a column of the legend.
fn count(picture: &[[u8; 3]], colour: [u8; 3]) -> usize {
    let is_of = |pixel: &&[u8; 3]| pixel.iter().zip(colour).all(|(&one, other)| one.abs_diff(other) <= 2);
    picture.iter().filter(is_of).count()
}

#[test]
fn the_kinds_of_taxels_are_counted() {
    let skin = Skin::new();
    assert!(done(&["inspect", text_of(&skin.at("pad.glb"))]).contains("2 temperature, 2 proximity, 2 force3"));
    assert!(!done(&["inspect", "hand"]).contains("pressure"));
    // A recording has three values of a taxel with three axes.
    let recording = done(&["info", text_of(&skin.at("touch.csv")), "--json"]);
    let known: serde_json::Value = serde_json::from_str(&recording).unwrap();
    assert_eq!(known["taxels"], 6, "{known}");
}

#[test]
fn each_quantity_is_plotted_in_the_letter_that_gives_it_with_its_unit() {
    let skin = Skin::new();
    let lines = skin.plot("temperature,nearest,shear,friction,torsion");
    let svg = lines.join("\n");
    for label in ["temperature [°C]", "nearest [mm]", "shear [N]", "friction", "torsion [N mm]"] {
        assert!(svg.contains(label), "{label}");
    }
    // A line for each: of the shear along u and v.
    let drawn = |outputs: &str| skin.plot(outputs).iter().filter(|line| line.contains("<polyline")).count();
    let without = drawn("total");
    assert!(drawn("total,temperature") > without && drawn("total,nearest") > without);
    // 25 to 35 °C and 60 to 20 mm: numbers of their axes.
    for number in ["30", "40", "60"] {
        assert!(lines.iter().any(|line| line.trim() == number), "{number}");
    }
    assert!(fails(2, &["plot", "-o", text_of(&skin.at("b.svg")), "--outputs", "temperature"]).contains("temperature"));
}

#[test]
fn taxels_have_the_colours_of_the_letter_that_is_asked_for() {
    let skin = Skin::new();
    let at = |map: [[u8; 3]; 256], share: f64| map[(255.0 * share).round() as usize];
    let Some(pressures) = skin.render(&[]) else { return };
    for share in [1.0, 0.5] {
        assert!(count(&pressures, at(pressure_colours(), share)) > 200, "{share}");
    }
    let warm = at(temperature_colours(), 40.0 / 50.0);
    assert_eq!(count(&pressures, warm), 0);
    let temperatures = skin.render(&["--letter", "temperature"]).unwrap();
    assert!(count(&temperatures, warm) > 200 && count(&temperatures, at(temperature_colours(), 0.6)) > 200);
    let distances = skin.render(&["--letter", "proximity"]).unwrap();
    assert!(count(&distances, at(distance_colours(), 20.0 / 80.0)) > 200);
    let shears = skin.render(&["--letter", "shear"]).unwrap();
    assert!(count(&shears, at(pressure_colours(), 0.5)) > 200);
    // Arrows are black around white, and there are none on temperatures.
    let black = [0; 3];
    assert!(count(&shears, black) > count(&temperatures, black) + 50);
}

#[test]
fn letters_that_cannot_be_drawn_are_refused() {
    let skin = Skin::new();
    let [body, touch, to] = ["pad.glb", "touch.csv", "a.png"].map(|name| skin.at(name));
    let render = ["render", text_of(&body), "-o", text_of(&to)];
    assert!(fails(2, &[&render[..], &["--letter", "shear"]].concat()).contains("--letter"));
    let drawn = [&render[..], &["--source", text_of(&touch)]].concat();
    assert!(fails(2, &[&drawn[..], &["--letter", "warmth"]].concat()).contains("there is no letter `warmth`"));
    assert!(fails(2, &[&drawn[..], &["--letter", "change"]].concat()).contains("changes are not drawn"));
    let bundled = concat!("csv:", env!("CARGO_MANIFEST_DIR"), "/bodies/touch.csv");
    let hand = ["render", "hand", "--source", bundled, "--letter", "temperature", "-o", text_of(&to)];
    assert!(fails(2, &hand).contains("letter `temperature` has no taxels"));
}
