//! `somatic render`: a picture of a body and its fields, or of touches on it.

mod touched;

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use somatic::Error;
use somatic::error::Result;
use somatic::field::FieldSet;
use somatic::internal::scene::choose_fields;
use somatic::internal::setup::FilesRead;
use somatic::internal::setup::bodies::load_body;
use somatic::picture::{self, ChartPicture, Options, View};

use super::stdio::DONE;

const EXAMPLES: &str = "\
Examples:
  somatic render robot.glb -o robot.png
  somatic render hand -o palm.png --field 'hand/palm*' --view top,bottom
  somatic render humanoid -o chart.png --uv head/skull/front_2
  somatic render hand -o hand.png --ids --look-at hand/palm --view bottom
  somatic render hand -o edges.png --edges
  somatic render hand -o touch.png --source touch.csv --at 2.9s
  somatic render hand -o touch.png --source touch.csv --from 1s --to 4s    an animation
  somatic render robot.glb -o warm.png --source touch.mcap --letter temperature
  somatic render insoles.csv -o peak.png       a pressure system's export, with its own sensors

With a recording, taxels have the colours of their pressures. Each touch has one mark: its
taxels have a rim of its colour, its id is at its place, an ellipse shows its principal axis
and spread, an arrow its motion of a quarter of a second, and a fading line where it was in the
last second. Without a recording a taxel in several fields shows a slice of each. Up to twelve
fields are named; of more, those side by side differ in colour.";

/// Draw a body with its taxels, or a touch.
///
/// Taxels are coloured by field, or by their pressures in a recording.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The robot: a .glb or .gltf file, or the bundled hand, sensing-hand, mat or humanoid [default: the source's own].
    ///
    /// A recording that has its body may be here, too: .mcap, sim:FILE.toml, or a pressure system's export.
    #[arg(value_name = "BODY", required_unless_present = "source")]
    body: Option<String>,

    /// The picture to write, PNG.
    #[arg(short, long, value_name = "FILE.png")]
    output: PathBuf,

    /// Sides to show: front, back, left, right, top, bottom, three-quarter, all [default: the four that show most].
    #[arg(long = "view", value_name = "VIEW", value_delimiter = ',')]
    views: Vec<String>,

    /// Colour only the fields whose names match, as globs; may be repeated [default: all that have no children].
    #[arg(long = "field", value_name = "GLOB")]
    fields: Vec<String>,

    /// Draw the chart of this field, laid flat, instead of the body.
    #[arg(long, value_name = "FIELD", conflicts_with = "views")]
    uv: Option<String>,

    /// Fill the picture with this field or link.
    #[arg(long, value_name = "NAME", conflicts_with = "uv")]
    look_at: Option<String>,

    /// Label taxels with their ids.
    #[arg(long, conflicts_with = "fields")]
    ids: bool,

    /// Connect taxels that are neighbours on the skin.
    #[arg(long, conflicts_with = "uv")]
    edges: bool,

    #[command(flatten)]
    touched: touched::Flags,

    /// Width in pixels, or WIDTHxHEIGHT with the largest height.
    #[arg(long, default_value = "1600", value_name = "PIXELS")]
    size: Size,

    /// Replace the picture if it is there.
    #[arg(long)]
    force: bool,
}

/// Width, and height at most, pixels.
#[derive(Clone, Copy)]
struct Size([u32; 2]);

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (width, height) = text.split_once('x').unwrap_or((text, text));
        let side = |side: &str| side.trim().parse::<u32>().ok().filter(|&side| side > 0);
        match (side(width), side(height)) {
            (Some(width), Some(height)) => Ok(Self([width, height])),
            _ => Err("give a width, or width and height, as 1600 or 1600x900".to_owned()),
        }
    }
}

pub(super) fn render(arguments: &Arguments) -> Result<u8> {
    let path = &arguments.output;
    if path.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("png")) {
        return Err(Error::usage("only PNG is drawn; let its name end in .png").at(path.display()));
    }
    let asked = arguments.touched.asked(arguments.body.as_deref())?;
    let output = FilesRead::from_scene(&asked, None).outputs(arguments.force).add(path)?;
    let mut views = Vec::new();
    for name in &arguments.views {
        match name.as_str() {
            "all" => views.extend(View::ALL),
            name => views.push(name.parse()?),
        }
    }
    let body = match &asked.body {
        Some(name) => load_body(name)?,
        None => super::scene::input(&asked)?.body(&asked)?,
    };
    let set = FieldSet::new(&body)?;
    let named = |globs: &[String]| choose_fields(&set, globs).map_err(|e| e.at(&body.name));
    let fields = if arguments.fields.is_empty() { Vec::new() } else { named(&arguments.fields)? };
    let (look_at, edges) = (arguments.look_at.clone(), arguments.edges);
    let options = Options { size: arguments.size.0, views, fields, look_at, edges };
    let charted = match &arguments.uv {
        None => None,
        Some(name) => match set.fields.iter().position(|field| field.name == *name) {
            Some(index) => Some(index),
            // A glob works if it names one field, and its errors are reported the same way.
            None => Some(named(std::slice::from_ref(name))?[0]),
        },
    };
    let ids = arguments.ids;
    let picture = match charted {
        _ if !asked.sources.is_empty() => {
            arguments.touched.draw(&asked, &body, (&set.fields, charted), &options, ids)?
        }
        Some(index) => ChartPicture::new(&body, &set.fields, index, &options, ids)?.of_fields(&set.fields)?.png()?,
        None if ids => touched::without(&body, &set.fields, &options)?,
        None => picture::of_body(&body, &set.fields, &options)?.png()?,
    };
    output.write(&picture)?;
    Ok(DONE)
}
