//! A body in words and tables.

use std::collections::BTreeMap;

use comfy_table::ColumnConstraint;
use console::style;
use rstar::RTree;
use somatic::author::Coverage;
use somatic::body::{Body, ChartKind, Modality, Taxel};
use somatic::field::{Field, WORLD};
use somatic::internal::author::cell_spread;
use somatic::internal::field::RestOverlap;

use super::inspection::{Inspection, cells_of};
use crate::cli::expected;
use crate::cli::table::{TextTable, plain, shown};
use crate::cli::words::{bullet, count, millimetres, one_line, spread, title};

/// All there is to say, the oddest last, where it is read.
pub(super) fn text(seen: &Inspection) -> String {
    let Inspection { body, fields, findings, .. } = seen;
    let mut text = format!("{}\n", title(&body.name));
    let mut line = |what: &str, value: String| text += &format!("  {what:<10}{}\n", one_line(&value));
    let triangles: usize = body.surfaces.iter().map(|surface| surface.triangles.len()).sum();
    line("links", body.links.len().to_string());
    let surfaces = count(triangles as u64, "triangle");
    line("surfaces", format!("{} with {surfaces}", body.surfaces.len()));
    for (number, what) in taxels(body).into_iter().enumerate() {
        line(if number == 0 { "taxels" } else { "" }, what);
    }
    if let Some(kinds) = kinds(body) {
        line("kinds", kinds);
    }
    if let Some(cells) = cell_spread(cells_of(body)) {
        line("cells", format!("{} of the median area, 5th to 95th percentile", spread(cells)));
    }
    for (what, value) in seen.errors.iter().flat_map(expected::lines) {
        line(what, value);
    }
    for (what, value) in coverage(body, &seen.coverage) {
        line(what, value);
    }
    for (what, value) in seen.graph.lines(body) {
        line(what, value);
    }
    let charts = fields.iter().filter(|field| field.chart.is_ok()).count();
    line("fields", format!("{}, {charts} with a chart", fields.len()));
    if !seen.overlaps.is_empty() {
        text += &format!("\n{}", shown(&overlaps(body, &seen.overlaps)));
    }
    if !body.links.is_empty() {
        text += &format!("\n{}", shown(&links(body, &seen.coverage)));
    }
    if !fields.is_empty() {
        text += &format!("\n{}", shown(&tree(body, fields)));
    }
    text += "\n";
    if findings.is_empty() {
        return text + "no findings\n";
    }
    text += &format!("{}\n", style(count(findings.len() as u64, "finding")).bold());
    for finding in findings {
        text += &bullet(finding);
    }
    text
}

/// How many taxels of each kind there are, if any measures something else than pressure.
fn kinds(body: &Body) -> Option<String> {
    let mut counts: BTreeMap<u32, (String, usize)> = BTreeMap::new();
    for taxel in &body.taxels {
        counts.entry(taxel.modality.code()).or_insert_with(|| (taxel.modality.name(), 0)).1 += 1;
    }
    let has_others = body.taxels.iter().any(|taxel| taxel.modality != Modality::Pressure);
    let kinds: Vec<String> = counts.into_values().map(|(name, count)| format!("{count} {name}")).collect();
    has_others.then(|| kinds.join(", "))
}

/// Number of taxels, how far they lie apart, and the area they stand for; a line for those that feel forces, and one for each other
/// kind, as each divides the skin anew.
fn taxels(body: &Body) -> Vec<String> {
    let mut kinds: BTreeMap<Option<u32>, Vec<&Taxel>> = BTreeMap::new();
    for taxel in &body.taxels {
        let kind = (!taxel.modality.is_pressed()).then(|| taxel.modality.code());
        kinds.entry(kind).or_default().push(taxel);
    }
    let (alone, all) = (kinds.len() < 2, body.taxels.len());
    let of_kind = |taxels: Vec<&Taxel>| match taxels.first() {
        Some(first) if !alone && !first.modality.is_pressed() => {
            spaced(body, &taxels, &format!(" {}", first.modality.name()))
        }
        _ if alone => spaced(body, &taxels, ""),
        _ => spaced(body, &taxels, &format!(" of {all} feel forces")),
    };
    if kinds.is_empty() { vec!["0".to_owned()] } else { kinds.into_values().map(of_kind).collect() }
}

fn spaced(body: &Body, taxels: &[&Taxel], what: &str) -> String {
    let mut text = format!("{}{what}", taxels.len());
    let places: Vec<[f64; 3]> = taxels
        .iter()
        .map(|taxel| body.links[taxel.link].body_from_link.transform_point3(taxel.position_in_link).to_array())
        .collect();
    let tree = RTree::bulk_load(places.clone());
    let nearest = |place: &[f64; 3]| tree.nearest_neighbor_iter_with_distance_2(*place).nth(1).map(|(_, d2)| d2.sqrt());
    let mut gaps: Vec<f64> = places.iter().filter_map(nearest).collect();
    gaps.sort_by(f64::total_cmp);
    if let (Some(least), Some(most)) = (gaps.first(), gaps.last()) {
        let [least, middle, most] = [*least, gaps[gaps.len() / 2], *most].map(millimetres);
        text += &format!(", {middle} mm apart ({least} to {most})");
    }
    let area: f64 = taxels.iter().map(|taxel| taxel.area).sum();
    if area > 0.0 {
        text += &format!(", {:.1} cm² of skin", area * 1e4);
    }
    let unknown = taxels.iter().filter(|taxel| taxel.area == 0.0).count();
    if unknown > 0 {
        text += &format!(", {unknown} without an area");
    }
    text
}

/// How much of the skin is seen, and its bare spots, under the names of their lines.
fn coverage(body: &Body, coverage: &Coverage) -> Vec<(&'static str, String)> {
    let (area, seen) = coverage.of_skin();
    if seen == 0.0 {
        return Vec::new();
    }
    let share = 100.0 * seen / area;
    let mut lines =
        vec![("coverage", format!("{share:.1} % of {:.1} cm² lies within the spacing of a taxel", area * 1e4))];
    for (number, hole) in coverage.holes.iter().enumerate() {
        let [x, y, z] = hole.position_in_link.to_array().map(millimetres);
        let (link, area) = (&body.links[hole.link].name, hole.area * 1e4);
        let what = if number == 0 { "bare" } else { "" };
        lines.push((what, format!("{area:.1} cm² around ({x}, {y}, {z}) mm of `{link}`")));
    }
    lines
}

fn links(body: &Body, coverage: &Coverage) -> TextTable {
    let mut table = plain(["link", "taxels", "cm²", "seen"], 1..4);
    let parents: Vec<Option<usize>> = body.links.iter().map(|link| link.parent).collect();
    let mut taxels_on = vec![0; body.links.len()];
    body.taxels.iter().for_each(|taxel| taxels_on[taxel.link] += 1);
    for (link, branch) in branches(&parents) {
        let taxels = taxels_on[link];
        let surface = coverage.links.iter().find(|of| of.link == link);
        let area = surface.map_or(String::new(), |of| format!("{:.1}", of.area * 1e4));
        let seen = surface.filter(|of| of.seen > 0.0);
        let seen = seen.map_or(String::new(), |of| format!("{:.0} %", 100.0 * of.seen / of.area));
        table.add_row([format!("{branch}{}", body.links[link].name), some(taxels), area, seen]);
    }
    table
}

/// Links whose taxels are so near at rest that touches there could be one contact.
fn overlaps(body: &Body, overlaps: &[RestOverlap]) -> TextTable {
    let mut table = plain(["near at rest", "taxels", "nearest mm", "within mm", "pairs that face"], 2..5);
    for overlap in overlaps {
        let [a, b] = overlap.links.map(|link| body.links[link].name.as_str());
        let [of_a, of_b] = overlap.taxels.each_ref().map(Vec::len);
        table.add_row([
            format!("{a}, {b}"),
            format!("{of_a}, {of_b}"),
            millimetres(overlap.nearest_m),
            millimetres(overlap.tolerance_m),
            some(overlap.facing),
        ]);
    }
    table
}

fn tree(body: &Body, fields: &[Field]) -> TextTable {
    let mut table = plain(["field", "taxels", "radius mm", "anchor", "distortion", "chart"], [1, 2, 4]);
    // Where it is narrow, reasons are wrapped and names are not.
    table.set_constraints((0..5).map(|_| ColumnConstraint::ContentWidth));
    let parents: Vec<Option<usize>> = fields.iter().map(|field| field.parent).collect();
    for (index, branch) in branches(&parents) {
        let field = &fields[index];
        let (chart, distortion) = match &field.chart {
            Ok(chart) => (kind(chart.kind).to_owned(), format!("{:.1} %", 100.0 * chart.distortion)),
            Err(reason) => (format!("none: {reason}"), String::new()),
        };
        table.add_row([
            format!("{branch}{}", field.name),
            field.members.len().to_string(),
            millimetres(field.radius_m()),
            field.anchor.map_or(WORLD, |anchor| &body.links[anchor].name).to_owned(),
            distortion,
            chart,
        ]);
    }
    table
}

fn kind(kind: ChartKind) -> &'static str {
    match kind {
        ChartKind::Plane => "plane",
        ChartKind::Geodesic => "geodesic",
        ChartKind::Normals => "normals",
        ChartKind::None => "none",
    }
}

/// Nothing is easier to see than a zero.
fn some(count: usize) -> String {
    if count == 0 { String::new() } else { count.to_string() }
}

/// Indices depth first, each with the lines that lead to it.
fn branches(parents: &[Option<usize>]) -> Vec<(usize, String)> {
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); parents.len()];
    let mut waiting: Vec<(usize, String, &str, &str)> = Vec::new();
    for (index, parent) in parents.iter().enumerate() {
        match parent {
            Some(parent) => children[*parent].push(index),
            None => waiting.push((index, String::new(), "", "")),
        }
    }
    waiting.reverse();
    let mut order = Vec::with_capacity(parents.len());
    while let Some((index, above, own, below)) = waiting.pop() {
        for (place, &child) in children[index].iter().enumerate().rev() {
            let last = place + 1 == children[index].len();
            let (own, next) = if last { ("└ ", "  ") } else { ("├ ", "│ ") };
            waiting.push((child, format!("{above}{below}"), own, next));
        }
        order.push((index, format!("{above}{own}")));
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_is_drawn_depth_first() {
        let parents = [None, Some(0), Some(0), Some(1), None];
        let drawn: Vec<String> = branches(&parents).iter().map(|(index, branch)| format!("{branch}{index}")).collect();
        assert_eq!(drawn, ["0", "├ 1", "│ └ 3", "└ 2", "4"]);
    }
}
