//! What `somatic author` says about what it made.

use std::path::Path;

use comfy_table::Cell;
use serde_json::{Value, json};
use somatic::author::{Authored, PlaceReport};
use somatic::body::Body;
use somatic::field::FieldSet;
use somatic::internal::expected::LayoutErrors;

use crate::cli::expected;
use crate::cli::table::{plain, shown};
use crate::cli::words::{bullet, count, millimetres, spread, title};

/// Links, ids and moves that a person is shown.
const MOST_LISTED: usize = 6;

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

/// A robot of more triangles gets the hint that its collision geometry is coarser.
const MANY_TRIANGLES: usize = 200_000;

fn triangles(authored: &Authored) -> usize {
    authored.body.surfaces.iter().map(|surface| surface.triangles.len()).sum()
}

/// The report for a person; `robot` says whether the mesh is a URDF with its visual geometry.
pub(super) fn text(output: &Path, authored: &Authored, errors: Option<&[LayoutErrors; 2]>, robot: bool) -> String {
    let body = &authored.body;
    let taxels = count(body.taxels.len() as u64, "taxel");
    let fields = count(body.fields.len() as u64, "field");
    let surface = match triangles(authored) {
        0 => String::new(),
        triangles => format!(", on {}", count(triangles as u64, "triangle")),
    };
    let mut text = format!("{}: {taxels} in {fields}{surface}\n", title(&output.display().to_string()));
    if authored.places.is_empty() {
        text += &format!(
            "  its taxels are those it had{}\n",
            if authored.notes.is_empty() { ", and nothing of them is stale" } else { "" }
        );
    } else {
        text += &format!("\n{}", table(&authored.places));
    }
    text += &centroids(authored);
    for (what, errors) in errors.into_iter().flat_map(expected::lines) {
        text += &format!(" {what}: {errors}\n");
    }
    for place in &authored.places {
        text += &moves(place);
    }
    for note in &authored.notes {
        text += &bullet(note);
    }
    if robot && triangles(authored) > MANY_TRIANGLES {
        text += &bullet("the robot's surface is fine; a coarser one is faster to work with: --geometry collision");
    }
    text
}

/// How many fields have a chart, in which a centroid is measured.
fn with_centroids(authored: &Authored) -> usize {
    // Whether a field has a chart does not depend on the surface, in which a search takes time.
    let Body { name, links, taxels, fields, .. } = &authored.body;
    let (name, links, taxels, fields) = (name.clone(), links.clone(), taxels.clone(), fields.clone());
    let bare = Body {
        name,
        links,
        taxels,
        fields,
        surfaces: Vec::new(),
        edges: None,
        findings: Vec::new(),
        kept: Default::default(),
    };
    FieldSet::new(&bare).map_or(0, |set| set.fields.iter().filter(|field| field.chart.is_ok()).count())
}

/// The last line of the table.
fn centroids(authored: &Authored) -> String {
    let (with, all) = (with_centroids(authored), authored.body.fields.len());
    let others = match all - with {
        0 => "",
        _ => "; the others, around a part or over several links, report totals and positions",
    };
    format!(" {with} of {all} fields have centroids{others}\n")
}

fn table(places: &[PlaceReport]) -> String {
    let mut table = plain(["place", "taxels", "least mm", "mean mm", "cells", "ids", "links"], 1..4);
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
            Cell::new(place.cell_spread.map_or_else(|| "–".to_owned(), spread)),
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

/// Places that lie nearer to the surface are on it: what is printed is 0.0 mm.
const SAME_PLACE_M: f64 = 0.05e-3;

/// How far places that were given had to be moved, the worst first.
fn moves(place: &PlaceReport) -> String {
    if place.moved_m.is_empty() {
        return String::new();
    }
    let mut worst = place.moved_m.clone();
    worst.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    if worst[0].1 < SAME_PLACE_M {
        return String::new();
    }
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

pub(super) fn summary(output: &Path, authored: &Authored, errors: Option<&[LayoutErrors; 2]>) -> Value {
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
        if let Some([low, high]) = place.cell_spread {
            object["cells"] = json!({"p5": low, "p95": high});
        }
        if !place.hidden_m2.is_empty() {
            object["hidden"] = json!(place.hidden_m2);
        }
        if !moved.is_empty() {
            object["moved"] = moved.into();
        }
        object
    };
    let mut summary = json!({
        "output": output.display().to_string(),
        "taxels": authored.body.taxels.len(),
        "triangles": triangles(authored),
        "fields": authored.body.fields.iter().map(|field| field.name.as_str()).collect::<Vec<_>>(),
        "places": authored.places.iter().map(place).collect::<Vec<_>>(),
        "with_centroids": with_centroids(authored),
        "notes": authored.notes,
    });
    if let Some(errors) = errors {
        summary["errors"] = errors[0].as_json_with_ideal(&errors[1]);
    }
    summary
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_on_the_surface_are_not_told_as_moved() {
        let moved = |moved_m: Vec<(u32, f64)>| {
            let mut place = PlaceReport::default();
            (place.name, place.moved_m) = ("th".to_owned(), moved_m);
            moves(&place)
        };
        assert_eq!(moved(vec![(200, 4.9e-5), (201, 0.0)]), "");
        let said = moved(vec![(200, 0.0), (201, 6e-5)]);
        assert!(
            said.contains("place `th`: moved to the surface by 0.0 mm on average; farthest 201 by 0.1 mm, 200"),
            "{said}"
        );
    }
}
