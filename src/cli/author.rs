//! `somatic author`: a mesh in, a body with a skin out.

use std::path::{Path, PathBuf};

use clap::Args;
use comfy_table::Cell;
use console::style;
use serde_json::{Value, json};
use somatic::author::{Authored, PlaceReport, Recipe, author};
use somatic::body::Original;
use somatic::error::nearest;
use somatic::{Error, Result, bundled};

use super::bar::Bar;
use super::files::FilesRead;
use super::stdio::{DONE, print};
use super::table::{plain, shown};
use super::words::{bullet, count, millimetres};

const EXAMPLES: &str = "\
Examples:
  somatic author hand.glb --taxels 500 --seed 1 -o skin.glb     500 taxels, evenly over all of it
  somatic author arm.glb --spacing 8mm --region 'forearm*' -o skin.glb
  somatic author arm.gltf --unit mm --recipe arm.toml -o skin.glb
  somatic inspect skin.glb
  somatic run --body skin.glb --source touch.csv

A recipe says it region by region:
  seed = 1
  bare = [\"nails\"]
  [regions.palm]
  node = \"palm*\"               # or material, attribute, box, except
  [regions.nails]
  material = \"nail\"
  [[place]]
  region = \"palm\"
  first_id = 0
  spacing = \"4 mm\"             # or taxels, with density; grid; points; csv; icub

Whatever else the file holds stays as it is. A layout that it has is replaced; a recipe without
[[place]] keeps its taxels and groups them anew. Without recipe, --taxels and --spacing the layout
is brought up to date, as after editing it in Blender:
  somatic author edited.glb -o skin.glb";

/// Links, ids and moves that a person is shown.
const MOST_LISTED: usize = 6;

/// Put a skin on a mesh: taxels placed as asked, in fields, in a file that Blender and every glTF viewer open.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The mesh: a .glb or .gltf file, or one of the bundled bodies hand, mat and humanoid.
    #[arg(value_name = "MESH")]
    mesh: String,

    /// What to place where, a TOML file.
    #[arg(long, value_name = "RECIPE.toml", conflicts_with_all = ["taxels", "spacing", "region"])]
    recipe: Option<PathBuf>,

    /// How many taxels, as evenly as blue noise goes.
    #[arg(long, value_name = "N")]
    taxels: Option<u64>,

    /// How far taxels are apart at least, such as 8mm; with --taxels exactly so many, else as many as fit.
    #[arg(long, value_name = "LENGTH")]
    spacing: Option<String>,

    /// Nodes, meshes or links that get taxels, as a glob; may be given again [default: all].
    #[arg(long, value_name = "GLOB")]
    region: Vec<String>,

    /// Which of many equally good placements [default: the recipe's, or 0].
    #[arg(long, value_name = "N")]
    seed: Option<u64>,

    /// What the mesh file's numbers are: um, mm, cm or m [default: the recipe's, or m, as glTF says].
    #[arg(long, value_name = "UNIT")]
    unit: Option<String>,

    /// The body to write, .glb or .gltf.
    #[arg(short, long, value_name = "BODY.glb")]
    output: PathBuf,

    /// Replace the output if it is there. The mesh itself is never replaced.
    #[arg(long)]
    force: bool,

    /// Print what was placed as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    check_ending(&arguments.output)?;
    let mut recipe = match &arguments.recipe {
        Some(path) => Recipe::load(path)?,
        None if arguments.taxels.is_none() && arguments.spacing.is_none() && arguments.region.is_empty() => {
            Recipe::none()
        }
        None => Recipe::simple(arguments.taxels, arguments.spacing.as_deref(), &arguments.region)?,
    };
    let read = FilesRead::default().bodies([&arguments.mesh]).files(&arguments.recipe).files(recipe.files());
    let output = read.outputs(arguments.force).add(&arguments.output)?;
    if let Some(seed) = arguments.seed {
        recipe = recipe.with_seed(seed);
    }
    if let Some(unit) = &arguments.unit {
        recipe = recipe.with_unit(unit).map_err(|e| e.at("--unit"))?;
    }
    let file = open(&arguments.mesh)?;
    let authored = {
        let mut bar = Bar::new("placing taxels");
        author(file, &recipe, |share| bar.show(share))?
    };
    authored.file.save(output)?;
    print(&match arguments.json {
        true => format!("{}\n", summary(&arguments.output, &authored)),
        false => text(&arguments.output, &authored),
    })?;
    Ok(DONE)
}

/// Refuses an output that would be no body, before any work is done.
fn check_ending(path: &Path) -> Result<()> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    if !matches!(ending.as_deref(), Some("glb" | "gltf")) {
        return Err(Error::usage("a body is a .glb or a .gltf; name the output so").at(path.display()));
    }
    Ok(())
}

/// The file `name`, or the bundled body of that name where there is no such file.
fn open(name: &str) -> Result<Original> {
    if !Path::new(name).exists() {
        if let Some(bytes) = bundled::body(name) {
            return Original::from_bytes(name, bytes, None);
        }
        if let Some(near) = nearest(name, bundled::BODIES) {
            return Err(Error::failed(format!("no such file; did you mean the bundled body `{near}`?")).at(name));
        }
    }
    Original::open(name)
}

/// `ids` as runs: `0–499, 1000`.
fn runs(ids: &[u32]) -> Vec<(u32, u32)> {
    let mut ids = ids.to_vec();
    ids.sort_unstable();
    let mut runs: Vec<(u32, u32)> = Vec::new();
    for id in ids {
        match runs.last_mut() {
            Some((_, last)) if *last + 1 == id => *last = id,
            _ => runs.push((id, id)),
        }
    }
    runs
}

fn text(output: &Path, authored: &Authored) -> String {
    let body = &authored.body;
    let taxels = count(body.taxels.len() as u64, "taxel");
    let fields = count(body.fields.len() as u64, "field");
    let mut text = format!("{}: {taxels} in {fields}\n", style(output.display()).bold());
    if authored.places.is_empty() {
        text += &format!(
            "  its taxels are those it had{}\n",
            if authored.notes.is_empty() { ", and nothing of them is stale" } else { "" }
        );
    } else {
        text += &format!("\n{}", table(&authored.places));
    }
    for place in &authored.places {
        text += &moves(place);
    }
    for note in &authored.notes {
        text += &bullet(note);
    }
    text
}

fn table(places: &[PlaceReport]) -> String {
    let mut table = plain(["place", "taxels", "least mm", "mean mm", "ids", "links"], 1..4);
    for place in places {
        let length = |metres: Option<f64>| Cell::new(metres.map_or_else(|| "–".to_owned(), millimetres));
        let run =
            |(first, last): &(u32, u32)| if first == last { first.to_string() } else { format!("{first}–{last}") };
        let ids: Vec<String> = runs(&place.ids).iter().map(run).collect();
        let links: Vec<String> = place.links.iter().map(|(link, number)| format!("{link} {number}")).collect();
        table.add_row([
            Cell::new(&place.name),
            Cell::new(place.ids.len()),
            length(place.least_spacing_m),
            length(place.mean_spacing_m),
            Cell::new(listed(&ids)),
            Cell::new(listed(&links)),
        ]);
    }
    shown(&table)
}

fn listed(words: &[String]) -> String {
    match words.get(..MOST_LISTED) {
        Some(first) if words.len() > MOST_LISTED => {
            format!("{} and {} more", first.join(", "), words.len() - MOST_LISTED)
        }
        _ => words.join(", "),
    }
}

/// How far places that were given had to be moved, the worst first.
fn moves(place: &PlaceReport) -> String {
    if place.moved_m.is_empty() {
        return String::new();
    }
    let mut worst = place.moved_m.clone();
    worst.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let mean = worst.iter().map(|(_, moved)| moved).sum::<f64>() / worst.len() as f64;
    let shown: Vec<String> =
        worst.iter().take(MOST_LISTED).map(|(id, moved)| format!("{id} by {} mm", millimetres(*moved))).collect();
    bullet(&format!(
        "place `{}`: moved to the surface by {} mm on average; farthest {}",
        place.name,
        millimetres(mean),
        shown.join(", ")
    ))
}

fn summary(output: &Path, authored: &Authored) -> Value {
    let place = |place: &PlaceReport| {
        let moved: Vec<Value> = place.moved_m.iter().map(|(id, moved)| json!({"id": id, "moved": moved})).collect();
        let mut object = json!({
            "name": place.name,
            "taxels": place.ids.len(),
            "ids": runs(&place.ids),
            "links": place.links,
        });
        if let (Some(least), Some(mean)) = (place.least_spacing_m, place.mean_spacing_m) {
            object["spacing"] = json!({"least": least, "mean": mean});
        }
        if !moved.is_empty() {
            object["moved"] = moved.into();
        }
        object
    };
    json!({
        "output": output.display().to_string(),
        "taxels": authored.body.taxels.len(),
        "fields": authored.body.fields.iter().map(|field| field.name.as_str()).collect::<Vec<_>>(),
        "places": authored.places.iter().map(place).collect::<Vec<_>>(),
        "notes": authored.notes,
    })
}
