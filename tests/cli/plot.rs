//! Plots of recordings: what is on them, and what cannot be drawn.

use std::path::Path;

use crate::{done, fails, files_in, output, stderr, text_of};

fn drawn(folder: &Path, name: &str, arguments: &[&str]) -> Vec<u8> {
    let path = folder.join(name);
    done(&[&["plot", "-o", text_of(&path), "--force"], arguments].concat());
    std::fs::read(path).unwrap()
}

/// The texts of an SVG, in their order.
fn texts(svg: &[u8]) -> Vec<String> {
    let text = std::str::from_utf8(svg).unwrap();
    let parts = text.split("<text").skip(1).filter_map(|rest| rest.split('>').nth(1)?.split('<').next());
    parts.map(|text| text.trim().to_owned()).collect()
}

#[test]
fn a_plot_has_load_area_and_maps_without_any_option() {
    let folder = tempfile::tempdir().unwrap();
    let svg = drawn(folder.path(), "a.svg", &[]);
    let texts = texts(&svg);
    let has = |wanted: &str| texts.iter().any(|text| text.contains(wanted));
    for wanted in
        ["bundled touch", "total [count]", "area [cm²]", "time [s]", "hand/palm", "pressure–time integral", "count·s"]
    {
        assert!(has(wanted), "{wanted}: {texts:?}");
    }
    // As PNG the same size.
    let png = drawn(folder.path(), "a.png", &[]);
    assert!(png.starts_with(b"\x89PNG"));
    let size = |at: usize| u32::from_be_bytes(png[at..at + 4].try_into().unwrap());
    let head = String::from_utf8_lossy(&svg[..200]).into_owned();
    assert!(head.contains(&format!("width=\"{}\" height=\"{}\"", size(16), size(20))), "{head}");
    // The same recording gives the same picture.
    assert_eq!(drawn(folder.path(), "b.svg", &[]), svg);
}

#[test]
fn recordings_stand_side_by_side_on_one_scale() {
    let folder = tempfile::tempdir().unwrap();
    let body = folder.path().join("mat.glb");
    done(&["author", "--grid", "2x3", "--pitch", "1cm", "-o", text_of(&body)]);
    let touch = |name: &str, most: u32| {
        let path = folder.path().join(name);
        let rows: String =
            (0..50).map(|n| format!("{},{},{},0,0,0,0\n", f64::from(n) * 0.1, most * n / 49, most / 2)).collect();
        std::fs::write(&path, format!("t,0,1,2,3,4,5\n{rows}")).unwrap();
        path
    };
    let (one, other) = (touch("one.csv", 100), touch("other.csv", 1000));
    let arguments = [text_of(&one), text_of(&other), "--body", text_of(&body), "--outputs", "total,speed"];
    let both = texts(&drawn(folder.path(), "a.svg", &arguments));
    let count = |wanted: &str| both.iter().filter(|text| text.contains(wanted)).count();
    assert_eq!(
        (count("one.csv"), count("other.csv"), count("speed [mm/s]"), count("time [s]")),
        (1, 1, 2, 2),
        "{both:?}"
    );
    assert_eq!((count("1500"), count("area")), (2, 0), "both have the scale of the larger one: {both:?}");
    // Alone, the smaller one has its own.
    let alone = texts(&drawn(folder.path(), "b.svg", &[&arguments[..1], &arguments[2..]].concat()));
    assert!(!alone.contains(&"1500".to_owned()), "{alone:?}");
}

#[test]
fn fields_and_times_are_chosen() {
    let folder = tempfile::tempdir().unwrap();
    let some = texts(&drawn(folder.path(), "a.svg", &["--fields", "hand/palm/*", "--from", "1", "--to", "2"]));
    assert!(
        some.iter().any(|text| text.starts_with("hand/palm/")) && !some.contains(&"hand/back".to_owned()),
        "{some:?}"
    );
    assert!(some.contains(&"1.0".to_owned()) && !some.contains(&"3.0".to_owned()), "{some:?}");
}

#[test]
fn what_cannot_be_plotted_is_reported_in_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| text_of(&folder.path().join(name)).to_owned();
    let svg = at("a.svg");
    assert!(fails(2, &["plot", "-o", &at("a.pdf")]).contains(".svg or .png"));
    assert!(fails(2, &["plot", "-o", &svg, "--outputs", "touches"]).contains("touches"));
    assert!(fails(2, &["plot", "-", "-o", &svg]).contains("only recordings"));
    assert!(fails(1, &["plot", &at("no.csv"), "-o", &svg]).contains("no.csv"));
    std::fs::write(at("empty.csv"), "t,4\n").unwrap();
    let none = output(&["plot", &at("empty.csv"), "-o", &svg]);
    assert!(none.status.code() == Some(1) && stderr(&none).contains("no frames"), "{}", stderr(&none));
    // A row that is cut off is left out, and said.
    std::fs::write(at("cut.csv"), "t,4,5\n0,1,2\n1,2,3\n2,3").unwrap();
    assert!(fails(3, &["plot", &at("cut.csv"), "-o", &svg]).contains("never processed"));
    assert_eq!(files_in(folder.path()), ["a.svg", "cut.csv", "empty.csv"]);
}

#[test]
fn no_line_goes_back_in_time_or_over_a_time_without_frames() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    done(&["author", "--grid", "2x3", "--pitch", "1cm", "-o", text_of(&at("mat.glb"))]);
    // To 2 s, from 5 to 6 s, and once more from 4 to 4.5 s.
    let times = (0..=20).chain(50..=60).chain(40..=45).map(|tenth| f64::from(tenth) * 0.1);
    let frames: String =
        times.map(|t| format!("{{\"t\": {t:.1}, \"values\": {{\"0\": 9, \"1\": {t:.1}}}}}\n")).collect();
    std::fs::write(at("back.ndjson"), frames).unwrap();
    let source = format!("ndjson:{}", text_of(&at("back.ndjson")));
    let svg = drawn(folder.path(), "a.svg", &[&source, "--body", text_of(&at("mat.glb")), "--outputs", "total"]);
    let svg = String::from_utf8(svg).unwrap();
    let lines = svg.split("<polyline ").filter(|line| line.contains("stroke=\"#0072B2\""));
    let points = lines.filter_map(|line| line.split("points=\"").nth(1)?.split('"').next());
    let across = |points: &str| -> Vec<f64> {
        points.split_whitespace().map(|point| point.split(',').next().unwrap().parse().unwrap()).collect()
    };
    let mut parts: Vec<Vec<f64>> = points.map(across).collect();
    // The first is the legend's. Two dots are a pixel, and six seconds are 760 pixels from 66 on.
    parts.remove(0);
    let second = |x: f64| (x / 2.0 - 66.0) / 760.0 * 6.0;
    let ends: Vec<[f64; 2]> = parts.iter().map(|part| [part[0], part[part.len() - 1]].map(second)).collect();
    let expected = [[0.0, 2.0], [5.0, 6.0], [4.0, 4.5]];
    let is_near = |(own, right): (&[f64; 2], &[f64; 2])| own.iter().zip(right).all(|(a, b)| (a - b).abs() < 0.01);
    assert!(ends.len() == 3 && ends.iter().zip(&expected).all(is_near), "{ends:?}");
    assert!(parts.iter().all(|part| part.windows(2).all(|pair| pair[0] <= pair[1])));
}

#[test]
fn a_noisy_line_stays_in_its_panel() {
    let folder = tempfile::tempdir().unwrap();
    let noisy = folder.path().join("noisy.csv");
    // 30 s at 200 Hz on the palm: far more frames than pixels, each far from the one before.
    let rows = (0..6000_u32).map(|frame| {
        let values = (0..9_u32).map(|taxel| (50 + (frame * 7919 + taxel * 104_729) % 300).to_string());
        format!("{:.3},{}", f64::from(frame) / 200.0, values.collect::<Vec<_>>().join(","))
    });
    let text = [vec!["t,0,1,2,3,4,5,6,7,8".to_owned()], rows.collect()].concat().join("\n");
    std::fs::write(&noisy, text + "\n").unwrap();
    let arguments = [
        "--body",
        "hand",
        "--fields",
        "hand/palm",
        "--fields",
        "hand/back",
        "--outputs",
        "total,orientation",
        text_of(&noisy),
    ];
    let png = drawn(folder.path(), "noisy.png", &arguments);
    let decoder = png::Decoder::new(std::io::Cursor::new(&png));
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    let width = reader.info().width as usize;
    // Two dots a pixel of the arrangement. Title and legend, panels 132 high and 16 apart, then the axis and the maps.
    let panels = [60..60 + 132, 208..208 + 132];
    let is_line = |pixel: &[u8]| [[0_u8, 114, 178], [213, 94, 0]].iter().any(|line| pixel == line);
    let (mut inside, mut outside) = (0, 0);
    for (at, pixel) in pixels.chunks_exact(3).enumerate() {
        let (x, y) = (at % width / 2, at / width / 2);
        let is_legend = y < 56;
        if !is_line(pixel) || is_legend {
            continue;
        }
        // Half the width of a line may stand out.
        let is_in =
            panels.iter().any(|panel| (panel.start - 2..panel.end + 2).contains(&y)) && (64..66 + 760 + 2).contains(&x);
        *(if is_in { &mut inside } else { &mut outside }) += 1;
    }
    assert!(inside > 10_000 && outside == 0, "{inside} dots of lines in their panels, {outside} outside");
    // As SVG the corners are round too, and the lines are no longer than the panel is wide, twice.
    let svg = String::from_utf8(drawn(folder.path(), "noisy.svg", &arguments)).unwrap();
    assert!(svg.contains("stroke-linejoin=\"round\""));
    let of_palm = svg.split("<polyline ").filter(|line| line.contains("stroke=\"#D55E00\""));
    let points = of_palm.filter_map(|line| line.split("points=\"").nth(1)?.split('"').next());
    let longest = points.map(|points| points.split_whitespace().count()).max();
    assert!(longest.unwrap() <= 4 * 760 + 8, "{longest:?} points");
}

/// A plot of `outputs` of one distance taxel, 29 mm beside the middle of its field, over which something comes nearer at 20 mm/s.
fn coming(folder: &Path, outputs: &str) -> String {
    let at = |name: &str| folder.join(name);
    let skin = "id,link,x,y,z,nx,ny,nz,area,modality\n300,pad,0.029,0,0,0,0,1,1.6e-5,proximity\n";
    std::fs::write(at("skin.csv"), skin).unwrap();
    std::fs::write(at("fields.toml"), "[[fields]]\nname = \"pad\"\ntaxels = [300]\n").unwrap();
    std::fs::write(at("near.toml"), "[proximity]\nunit = \"mm\"\nrange = 300\n").unwrap();
    let rows: String = (0..100).map(|n| format!("{},{}\n", 0.05 * f64::from(n), 200 - n)).collect();
    std::fs::write(at("near.csv"), format!("t,300\n{rows}")).unwrap();
    let [skin, bare, fields, body, near, known] =
        ["skin.csv", "bare.glb", "fields.toml", "pad.glb", "near.csv", "near.toml"].map(at);
    done(&["author", "--csv-skin", text_of(&skin), "-o", text_of(&bare)]);
    done(&["author", text_of(&bare), "--recipe", text_of(&fields), "-o", text_of(&body)]);
    let how = ["--body", text_of(&body), "--calibration", text_of(&known), "--outputs", outputs];
    String::from_utf8(drawn(folder, "a.svg", &[&[text_of(&near)][..], &how].concat())).unwrap()
}

/// The value of `key` in a tag of an SVG.
fn attribute<'a>(tag: &'a str, key: &str) -> &'a str {
    tag.split_once(&format!(" {key}=\"")).and_then(|(_, rest)| rest.split('"').next()).unwrap()
}

#[test]
fn a_constant_is_a_flat_line_whatever_its_rounding_and_numbers_leave_the_name_of_their_axis_free() {
    let folder = tempfile::tempdir().unwrap();
    let svg = coming(folder.path(), "approach_speed");
    let texts = texts(svg.as_bytes());
    assert!(texts.iter().any(|text| text == "20") && texts.iter().all(|text| !text.contains("0.00000")), "{texts:?}");
    let lines = svg.lines().filter(|line| line.contains("<polyline"));
    let longest = lines.max_by_key(|line| attribute(line, "points").len()).unwrap();
    let heights: Vec<f64> = attribute(longest, "points")
        .split_whitespace()
        .map(|point| point.split_once(',').unwrap().1.parse().unwrap())
        .collect();
    assert!(heights.len() > 20 && heights.iter().all(|height| (height - heights[0]).abs() <= 1.0), "{heights:?}");
}

#[test]
fn the_words_about_components_are_beside_their_lines() {
    let folder = tempfile::tempdir().unwrap();
    let svg = coming(folder.path(), "nearest_position");
    let text = svg.split("<text").find(|text| text.contains("paler")).unwrap();
    let [right, middle] = ["x", "y"].map(|key| attribute(text, key).parse::<f64>().unwrap());
    // In dots: 10 pixels high, and about 120 wide.
    let is_at = |[x, y]: [f64; 2]| (right - 240.0..=right).contains(&x) && (middle - 9.0..=middle + 9.0).contains(&y);
    let mut segments = 0;
    for line in svg.lines().filter(|line| line.contains("<polyline")) {
        let point = |text: &str| {
            let (x, y) = text.split_once(',').unwrap();
            [x.parse::<f64>().unwrap(), y.parse().unwrap()]
        };
        let points: Vec<[f64; 2]> = attribute(line, "points").split_whitespace().map(point).collect();
        for ends in points.windows(2) {
            let along = |share: f64| [0, 1].map(|axis| ends[0][axis] + share * (ends[1][axis] - ends[0][axis]));
            assert!((0..=100).all(|step| !is_at(along(f64::from(step) / 100.0))), "{line}");
            segments += 1;
        }
    }
    assert!(segments > 10);
}
