//! `somatic render`.

use std::path::Path;

use super::skips::skip;
use super::{fails, file, files_in, output, somatic, stderr, text_of};

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
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let why = fails(1, &["render", "hand", "--uv", "hand", "-o", text_of(&path)]);
    assert!(why.contains("field `hand` has no chart to draw: its taxels sit on 5 links"), "{why}");
    assert!(files_in(folder.path()).is_empty());
}

#[test]
fn what_cannot_be_drawn_is_told_in_a_line_and_leaves_nothing() {
    let (folder, path) = file("there.png", "not a picture");
    let why = |code: i32, arguments: &[&str]| {
        let why = fails(code, &[&["render", "hand", "-o"], arguments].concat());
        assert_eq!(why.lines().count(), 1, "{why}");
        why
    };
    assert!(why(1, &[text_of(&path)]).contains("there already; --force replaces it"));
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
    let (folder, path) = file("there.png", "not a picture");
    let output = output(&["render", "hand", "--size", "300", "--view", "top", "-o", text_of(&path), "--force"]);
    if stderr(&output).contains("no GPU driver answers") {
        return skip("GPU", "no adapter answers");
    }
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(Picture::read(&path).width, 300);
    assert_eq!(files_in(folder.path()), ["there.png"]);
}
