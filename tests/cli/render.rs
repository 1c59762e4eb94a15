//! `somatic render`.

use std::path::Path;

use super::{done, fails, file, files_in, output, somatic, stderr, text_of};
use somatic_testing::skip;

/// Renders with `arguments` into a folder of its own. `None`, and a skip, where no adapter answers.
fn render(arguments: &[&str]) -> Option<Picture> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    let output = output(&[&["render"], arguments, &["-o", text_of(&path)]].concat());
    let said = stderr(&output);
    if said.contains("no GPU driver answers") {
        skip("GPU", "no adapter answers");
        return None;
    }
    assert_eq!((output.status.code(), said.as_str()), (Some(0), ""), "{arguments:?}");
    assert!(output.stdout.is_empty());
    assert_eq!(files_in(folder.path()), ["picture.png"]);
    Some(Picture::read(&path))
}

struct Picture {
    width: u32,
    height: u32,
    pixels: Vec<u8>,
}

impl Picture {
    fn read(path: &Path) -> Self {
        let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        Self { width: info.width, height: info.height, pixels }
    }

    fn at(&self, x: u32, y: u32) -> [u8; 3] {
        let start = 3 * (y * self.width + x) as usize;
        [self.pixels[start], self.pixels[start + 1], self.pixels[start + 2]]
    }

    /// Pixels whose hue is that of `colour`, by its largest and smallest part, in a body that is grey.
    fn of_colour(&self, colour: [u8; 3]) -> usize {
        let like = |pixel: &[u8]| {
            let scale = f64::from(*colour.iter().max().unwrap()) / f64::from(*pixel.iter().max().unwrap()).max(1.0);
            pixel.iter().zip(colour).all(|(&p, c)| (f64::from(p) * scale - f64::from(c)).abs() < 24.0)
        };
        self.pixels.chunks_exact(3).filter(|pixel| like(pixel)).count()
    }
}

const BLUE: [u8; 3] = [0x00, 0x72, 0xB2];
const ORANGE: [u8; 3] = [0xE6, 0x9F, 0x00];

#[test]
fn edges_connect_neighbours_that_a_view_sees() {
    // With the middle of the mat on a pixel, diagonals are even.
    let arguments = ["mat", "--view", "top", "--size", "901x900"];
    let Some(plain) = render(&arguments) else { return };
    let lined = render(&[&arguments[..], &["--edges"]].concat()).unwrap();
    let pairs = plain.pixels.chunks_exact(3).zip(lined.pixels.chunks_exact(3));
    let changed: Vec<&[u8]> = pairs.filter(|(before, after)| before != after).map(|(_, after)| after).collect();
    assert!(changed.len() > 1000, "{}", changed.len());
    assert!(changed.iter().all(|pixel| *pixel == [0x30, 0x34, 0x3A]));
    // From below no taxel is seen.
    let below = ["mat", "--view", "bottom", "--size", "900"];
    assert_eq!(render(&below).unwrap().pixels, render(&[&below[..], &["--edges"]].concat()).unwrap().pixels);
    assert!(fails(2, &["render", "hand", "-o", "a.png", "--edges", "--uv", "hand/palm"]).contains("--uv"));
}

#[test]
fn a_body_is_drawn_in_the_colours_of_its_fields() {
    let Some(hand) = render(&["hand", "--size", "900"]) else { return };
    assert_eq!(hand.width, 900);
    assert!((300..=900).contains(&hand.height), "{}", hand.height);
    // Nothing is cut off: the border is the paper.
    let paper = hand.at(0, 0);
    assert!((0..hand.height).all(|y| hand.at(0, y) == paper && hand.at(899, y) == paper));
    assert!((0..900).all(|x| hand.at(x, hand.height - 1) == paper));
    // The grey body takes a good part of the picture, and nine blue taxels a part of that.
    let grey = hand.pixels.chunks_exact(3).filter(|p| p[0].abs_diff(p[2]) < 16 && (90..215).contains(&p[0])).count();
    assert!(grey > hand.pixels.len() / 3 / 5, "{grey}");
    let blue = hand.of_colour(BLUE);
    assert!((1000..20_000).contains(&blue), "{blue}");

    // Only the field asked for is coloured, in the first colour.
    let Some(side) = render(&["hand", "--size", "900", "--field", "hand/side"]) else { return };
    assert!(side.of_colour(ORANGE) == 0 && side.of_colour(BLUE) > 300 && side.of_colour(BLUE) < blue);
    let Some(one) = render(&["hand", "--size", "400x300", "--view", "top"]) else { return };
    assert!(one.width == 400 && one.height <= 300);
}

#[test]
fn a_chart_is_drawn_flat() {
    let Some(chart) = render(&["hand", "--size", "500", "--uv", "hand/palm"]) else { return };
    // Four quadrants, each with the better part of a colour.
    for colour in [BLUE, ORANGE, [0x00, 0x9E, 0x73], [0xCC, 0x79, 0xA7]] {
        assert!(chart.of_colour(colour) > 2000, "{colour:?}");
    }
    // With the pressures of a touch, and with ids.
    let source = concat!("csv:", env!("CARGO_MANIFEST_DIR"), "/bodies/touch.csv");
    let of = |more: &[&str]| {
        let wanted = ["hand", "--size", "500", "--uv", "hand/back", "--source", source, "--at"];
        render(&[&wanted[..], more].concat()).unwrap()
    };
    let (rest, touched, named) = (of(&["0"]), of(&["2.9"]), of(&["2.9", "--ids"]));
    let (before, after) = (rest.of_colour(SKY), touched.of_colour(SKY));
    assert!(after > before + 1000, "rims of the touch: {before} and {after} pixels");
    let white = |picture: &Picture| picture.pixels.chunks_exact(3).filter(|pixel| **pixel == [0xFF; 3]).count();
    assert!(white(&named) > white(&touched), "ids are light on dark taxels");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let why = fails(1, &["render", "hand", "--uv", "hand", "-o", text_of(&path)]);
    assert!(why.contains("field `hand` has no chart to draw: its taxels sit on 5 links"), "{why}");
    assert!(files_in(folder.path()).is_empty());
}

/// The colours of pressure at the ends of their scale.
const LEAST: [u8; 3] = [0x26, 0x2F, 0x8B];
const MOST: [u8; 3] = [0xFA, 0xEE, 0x76];

/// The colour of the touch whose id is 5.
const SKY: [u8; 3] = [0x56, 0xB4, 0xE9];

#[test]
fn a_touch_is_drawn_at_a_time_and_as_an_animation() {
    let source = concat!("csv:", env!("CARGO_MANIFEST_DIR"), "/bodies/touch.csv");
    let of = |more: &[&str]| render(&[&["hand", "--source", source, "--size", "600", "--view", "top"], more].concat());
    let (Some(rest), Some(touched)) = (of(&["--at", "0"]), of(&["--at", "2.9"])) else { return };
    assert_eq!((rest.width, touched.width), (600, 600));
    // The legend alone has the colours of pressure until something is touched.
    for colour in [LEAST, MOST] {
        let (before, after) = (rest.of_colour(colour), touched.of_colour(colour));
        assert!(before > 10 && after > before + 100, "{colour:?}: {before} and {after} pixels");
    }
    // The fifth touch of the recording: rims of its taxels, its ellipse and its trail.
    let (before, after) = (rest.of_colour(SKY), touched.of_colour(SKY));
    assert!(after > before + 150, "{before} and {after} pixels of the touch");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let range = ["--from", "2", "--to", "3", "--rate", "5", "-o", text_of(&path)];
    done(&[&["render", "hand", "--source", source, "--size", "400", "--view", "top"], &range[..]].concat());
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let control = *reader.info().animation_control().expect("an animation");
    assert_eq!((control.num_frames, control.num_plays), (6, 0));
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let areas: Vec<u32> = (0..6)
        .map(|_| {
            let info = reader.next_frame(&mut pixels).unwrap();
            info.width * info.height
        })
        .collect();
    assert!(areas[1..].iter().all(|&area| area < areas[0]), "of later pictures what differs is stored: {areas:?}");
    assert!(fails(2, &["render", "hand", "--at", "1", "-o", "b.png"]).contains("--source"));
    let late = ["render", "hand", "--source", source, "--from", "60", "-o", "b.png"];
    assert!(fails(2, &late).contains("no frames from 60 s on; give a time of its own, from 0 to "));
}

#[test]
fn a_part_of_a_body_fills_a_picture_with_ids() {
    let near = ["humanoid", "--size", "500", "--view", "front", "--ids"];
    let Some(all) = render(&near) else { return };
    let part = render(&[&near[..], &["--look-at", "head"]].concat()).unwrap();
    let dark = |picture: &Picture| picture.pixels.chunks_exact(3).filter(|pixel| pixel.iter().all(|&p| p < 80)).count();
    assert!(dark(&part) != dark(&all) && all.width == part.width);
    let line = fails(2, &["render", "hand", "--look-at", "hand/plam", "-o", "b.png"]);
    assert!(line.contains("did you mean `hand/palm`?"), "{line}");
}

#[test]
fn what_cannot_be_drawn_is_reported_in_a_line_and_leaves_nothing() {
    let (folder, path) = file("there.png", "not a picture");
    let why = |code: i32, arguments: &[&str]| {
        let why = fails(code, &[&["render", "hand", "-o"], arguments].concat());
        assert_eq!(why.lines().count(), 1, "{why}");
        why
    };
    assert!(why(1, &[text_of(&path)]).contains("it exists; choose another name, or give --force"));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "not a picture");
    let other = folder.path().join("other.png");
    let other = text_of(&other);
    assert!(why(2, &[other, "--view", "frnt"]).contains("did you mean `front`"));
    assert!(why(2, &[other, "--field", "hand/plam"]).contains("did you mean `hand/palm`"));
    assert!(why(2, &[other, "--size", "60"]).contains("width of 240"));
    assert!(why(2, &[other, "--size", "9000"]).contains("up to 8192"));
    assert!(why(2, &[text_of(&folder.path().join("other.jpg"))]).contains(".png"));
    let (_bare, bare) = file("bare.gltf", r#"{"asset":{"version":"2.0"},"nodes":[{"name":"arm"}]}"#);
    let why = fails(1, &["render", text_of(&bare), "-o", other]);
    assert!(why.contains("neither surface nor taxels"), "{why}");
    assert_eq!(files_in(folder.path()), ["there.png"]);
}

#[test]
#[cfg(target_os = "linux")]
fn without_a_driver_it_says_what_would_help() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let mut command = somatic(&["render", "hand", "-o", text_of(&path)]);
    let nowhere = folder.path().join("no_driver.json");
    command.env("VK_DRIVER_FILES", &nowhere).env("VK_ICD_FILENAMES", &nowhere);
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let said = stderr(&output);
    assert!(said.lines().count() == 1 && said.contains("mesa-vulkan-drivers"), "{said}");
    assert!(files_in(folder.path()).is_empty());
}

#[test]
fn force_replaces_a_picture() {
    // Without an adapter it cannot be known.
    if render(&["hand", "--size", "300", "--view", "top"]).is_none() {
        return;
    }
    let (folder, path) = file("there.png", "not a picture");
    done(&["render", "hand", "--size", "300", "--view", "top", "-o", text_of(&path), "--force"]);
    assert_eq!(Picture::read(&path).width, 300);
    assert_eq!(files_in(folder.path()), ["there.png"]);
}

#[test]
fn a_small_field_is_drawn_whole_with_its_words() {
    // One taxel, two, and those of a finger.
    let (folder, recipe) = file("recipe.toml", "existing = \"keep\"\n[[fields]]\nname = \"one\"\ntaxels = [3]\n");
    let one = folder.path().join("one.glb");
    done(&["author", "hand", "--recipe", text_of(&recipe), "-o", text_of(&one)]);
    let fields = [
        (text_of(&one), "one", 1),
        ("hand", "hand/side", 2),
        ("hand", "hand/midhand/index", 5),
        ("hand", "hand/palm", 9),
    ];
    for size in ["400", "1000"] {
        for (body, field, taxels) in fields {
            let Some(chart) = render(&[body, "--uv", field, "--size", size]) else { return };
            let paper = chart.at(0, 0);
            // The border is paper: neither disc nor rim nor word is cut off.
            let (right, bottom) = (chart.width - 1, chart.height - 1);
            assert!(
                (0..chart.height).all(|y| chart.at(0, y) == paper && chart.at(right, y) == paper),
                "{field} {size}"
            );
            assert!((0..chart.width).all(|x| chart.at(x, bottom) == paper), "{field} {size}");
            // Between the title and the discs there is paper, and so between them and the legend.
            let inked = |y: u32| (0..chart.width).any(|x| chart.at(x, y) != paper);
            let bands = (1..chart.height).filter(|&y| inked(y) && !inked(y - 1)).count();
            assert!(bands >= 3, "{field} {size}: {bands} bands");
            // A single disc stands in the middle with room around it.
            if taxels == 1 {
                let share = chart.of_colour(BLUE) as f64 / f64::from(chart.width * chart.height);
                assert!((0.02..0.3).contains(&share), "{size}: {share}");
            }
        }
    }
}

#[test]
fn words_grow_with_the_picture() {
    // The title is the first band of ink.
    let title = |size: &str| -> Option<u32> {
        let chart = render(&["hand", "--uv", "hand/side", "--size", size])?;
        let paper = chart.at(0, 0);
        let inked = |y: &u32| (0..chart.width).any(|x| chart.at(x, *y) != paper);
        let top = (0..chart.height).find(inked).unwrap();
        Some((top..chart.height).take_while(inked).count() as u32)
    };
    let (Some(small), Some(large)) = (title("1000"), title("3000")) else { return };
    assert!((3 * small).abs_diff(large) <= 4, "{small} {large} pixels");
}

#[test]
fn a_part_of_a_body_is_drawn_from_where_it_is_seen_and_its_views_stand_apart() {
    let of = |more: &[&str]| render(&[&["sensing-hand", "--look-at", "hand/palm", "--size", "600"], more].concat());
    let (Some(usual), Some(below)) = (of(&[]), of(&["--view", "bottom"])) else { return };
    assert!(usual.pixels == below.pixels && usual.height == below.height, "the palm looks down");
    // Views that are asked for are drawn, each with paper around it: also where the rest of the hand goes on beyond its view.
    let two = of(&["--view", "bottom,top"]).unwrap();
    let paper = two.at(0, 0);
    let filled = |x: u32| (60..two.height - 60).filter(|&y| two.at(x, y) != paper).count();
    let bands: Vec<bool> = (0..600).map(|x| filled(x) > 0).collect();
    let begins = bands.windows(2).filter(|pair| !pair[0] && pair[1]).count();
    assert!(begins == 2 && bands[..3].iter().chain(&bands[597..]).all(|filled| !filled), "{begins}");
}
