//! Taking an old layout out of somebody's file, so that a new one replaces it.
//!
//! What was added last goes without a trace. What an editor has put between the file's own things is taken out as far as
//! numbers can be put right; meshes and accessors there stay behind unused.

use std::collections::BTreeSet;

use super::layout::{FIELD_KEY, TAXEL_ID};
use super::original::{Original, set_length};
use super::splice::{Span, Splice};
use crate::error::{Error, Result};

/// Extensions whose names begin so say nothing of nodes by their numbers.
const BLIND_TO_NODES: [&str; 6] =
    ["KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_mesh_quantization", "MSFT_texture_"];

/// What a file has of an old layout.
#[derive(Default)]
struct Old {
    /// Nodes that go.
    nodes: BTreeSet<usize>,
    /// Layout nodes that something else needs; they lose what makes them that.
    emptied: Vec<usize>,
    /// Meshes of nothing but taxels that no other node shows.
    meshes: BTreeSet<usize>,
    /// Meshes that are taxels in part.
    mixed: Vec<usize>,
}

/// Takes the fields out of `original`, and unless `keep_taxels` the taxels.
pub(super) fn clear_layout(original: &mut Original, keep_taxels: bool) -> Result<()> {
    let splice = Splice::new(&original.text);
    let old = find(&splice, keep_taxels);
    if old.nodes.is_empty() && old.emptied.is_empty() && old.mixed.is_empty() {
        return Ok(());
    }
    let count = splice.list("nodes").len();
    let shifts = old.nodes.first().is_some_and(|&first| count - first > old.nodes.len());
    let used = splice.member(&splice.root(), "extensionsUsed").map_or_else(Vec::new, |list| splice.elements(&list));
    let used = used.iter().map(|span| splice.get(span).trim_matches('"'));
    let sighted = used.into_iter().find(|name| !BLIND_TO_NODES.iter().any(|known| name.starts_with(known)));
    if let Some(name) = sighted.filter(|_| shifts) {
        return Err(Error::failed(format!(
            "its old layout stands between nodes that the extension {name} may number; remove the taxels and fields in an \
             editor, or start from the file without them"
        )));
    }
    let text = emptied(splice, &old);
    let (text, end) = without(Splice::new(&text), &old);
    original.text = text;
    if let Some(end) = end {
        original.bin.truncate(end);
    }
    Ok(())
}

fn numbers(splice: &Splice<'_>, span: &Span, key: &str) -> Vec<usize> {
    let list = splice.member(span, key).map_or_else(Vec::new, |list| splice.elements(&list));
    list.iter().filter_map(|span| splice.number(span)).collect()
}

fn number(splice: &Splice<'_>, span: &Span, key: &str) -> Option<usize> {
    splice.member(span, key).and_then(|span| splice.number(&span))
}

fn is_taxels(splice: &Splice<'_>, primitive: &Span) -> bool {
    let attributes = splice.member(primitive, "attributes").map_or_else(Vec::new, |span| splice.members(&span));
    number(splice, primitive, "mode") == Some(0)
        && attributes.iter().any(|(key, _)| key.strip_prefix('_') == Some(TAXEL_ID))
}

fn primitives(splice: &Splice<'_>, mesh: &Span) -> Vec<Span> {
    splice.member(mesh, "primitives").map_or_else(Vec::new, |list| splice.elements(&list))
}

fn find(splice: &Splice<'_>, keep_taxels: bool) -> Old {
    let (nodes, meshes) = (splice.list("nodes"), splice.list("meshes"));
    let taxels_of = |mesh: &Span| {
        let primitives = primitives(splice, mesh);
        let taxels = primitives.iter().filter(|primitive| is_taxels(splice, primitive)).count();
        (taxels, primitives.len())
    };
    let taxels: Vec<(usize, usize)> =
        meshes.iter().map(|mesh| if keep_taxels { (0, 1) } else { taxels_of(mesh) }).collect();
    let all_taxels = |mesh: usize| taxels.get(mesh).is_some_and(|&(taxels, all)| taxels > 0 && taxels == all);
    let mut old =
        Old { mixed: (0..meshes.len()).filter(|&m| taxels[m].0 > 0 && !all_taxels(m)).collect(), ..Old::default() };
    old.meshes = (0..meshes.len()).filter(|&mesh| all_taxels(mesh)).collect();

    let needed = needed_nodes(splice);
    let children: Vec<Vec<usize>> = nodes.iter().map(|node| numbers(splice, node, "children")).collect();
    let mut layout = Vec::new();
    for (index, node) in nodes.iter().enumerate() {
        let mesh = number(splice, node, "mesh");
        let is_field = splice.member(node, "extras").is_some_and(|extras| splice.member(&extras, FIELD_KEY).is_some());
        let shows_taxels = mesh.is_some_and(all_taxels);
        if is_field || shows_taxels {
            let free = (mesh.is_none() || shows_taxels) && !needed.contains(&index);
            layout.push((index, free && splice.member(node, "camera").is_none()));
        }
    }
    // A node goes when all below it do.
    loop {
        let before = old.nodes.len();
        for &(index, _) in layout.iter().filter(|(_, free)| *free) {
            if children[index].iter().all(|child| old.nodes.contains(child)) {
                old.nodes.insert(index);
            }
        }
        if old.nodes.len() == before {
            break;
        }
    }
    old.emptied = layout.into_iter().map(|(index, _)| index).filter(|index| !old.nodes.contains(index)).collect();
    old
}

/// Nodes that skins and animations name.
fn needed_nodes(splice: &Splice<'_>) -> BTreeSet<usize> {
    node_numbers(splice).iter().filter_map(|span| splice.number(span)).collect()
}

/// Where skins and animations have the numbers of nodes.
fn node_numbers(splice: &Splice<'_>) -> Vec<Span> {
    let mut spans = Vec::new();
    for skin in splice.list("skins") {
        spans.extend(splice.member(&skin, "skeleton"));
        spans.extend(splice.member(&skin, "joints").map_or_else(Vec::new, |list| splice.elements(&list)));
    }
    for animation in splice.list("animations") {
        let channels = splice.member(&animation, "channels").map_or_else(Vec::new, |list| splice.elements(&list));
        let targets = channels.iter().filter_map(|channel| splice.member(channel, "target"));
        spans.extend(targets.filter_map(|target| splice.member(&target, "node")));
    }
    spans
}

/// The text with what is left of the layout where nodes and meshes stay.
fn emptied(mut splice: Splice<'_>, old: &Old) -> String {
    let (nodes, meshes) = (splice.list("nodes"), splice.list("meshes"));
    for &index in &old.emptied {
        let shows_taxels = number(&splice, &nodes[index], "mesh").is_some_and(|mesh| old.meshes.contains(&mesh));
        if shows_taxels {
            splice.remove_members(&nodes[index], |key| key == "mesh" || key == "skin");
        }
        if let Some(extras) = splice.member(&nodes[index], "extras") {
            splice.remove_members(&extras, |key| key == FIELD_KEY);
        }
    }
    for &index in &old.mixed {
        let all = primitives(&splice, &meshes[index]);
        let gone: Vec<bool> = all.iter().map(|primitive| is_taxels(&splice, primitive)).collect();
        if let Some(list) = splice.member(&meshes[index], "primitives") {
            splice.remove_elements(&list, |i| gone[i]);
        }
    }
    splice.apply()
}

/// The text without `old`, and where the buffer ends now, if it became shorter.
fn without(mut splice: Splice<'_>, old: &Old) -> (String, Option<usize>) {
    let root = splice.root();
    let nodes = splice.list("nodes");
    let new_number = |node: usize| node - old.nodes.range(..node).count();
    let renumber = |splice: &mut Splice<'_>, span: Span| {
        if let Some(node) = splice.number(&span).filter(|&node| new_number(node) != node && !old.nodes.contains(&node))
        {
            splice.replace(span, new_number(node).to_string());
        }
    };
    for span in node_numbers(&splice) {
        renumber(&mut splice, span);
    }
    let owners =
        nodes.iter().enumerate().filter(|(index, _)| !old.nodes.contains(index)).map(|(_, node)| (node, "children"));
    let scenes = splice.list("scenes");
    for (owner, key) in owners.chain(scenes.iter().map(|scene| (scene, "nodes"))) {
        let Some(list) = splice.member(owner, key) else { continue };
        let elements = splice.elements(&list);
        let goes = |i: usize| splice_number_in(&splice, &elements[i], &old.nodes);
        let gone: Vec<bool> = (0..elements.len()).map(goes).collect();
        if gone.iter().all(|&gone| gone) {
            // A list of nothing is none.
            splice.remove_members(owner, |member| member == key);
            continue;
        }
        splice.remove_elements(&list, |i| gone[i]);
        for span in elements {
            renumber(&mut splice, span);
        }
    }
    let tail = Tail::of(&splice, old);
    let mut emptied = Vec::new();
    for (key, kept) in [("meshes", tail.meshes), ("accessors", tail.accessors), ("bufferViews", tail.views)] {
        let Some(list) = splice.member(&root, key) else { continue };
        match kept {
            0 => emptied.push(key),
            kept => splice.remove_elements(&list, |i| i >= kept),
        }
    }
    if let Some(list) = splice.member(&root, "nodes") {
        match nodes.len() == old.nodes.len() {
            true => emptied.push("nodes"),
            false => splice.remove_elements(&list, |i| old.nodes.contains(&i)),
        }
    }
    match tail.end {
        Some(0) => emptied.push("buffers"),
        Some(end) => set_length(&mut splice, end),
        None => {}
    }
    splice.remove_members(&root, |key| emptied.contains(&key));
    (splice.apply(), tail.end)
}

fn splice_number_in(splice: &Splice<'_>, span: &Span, set: &BTreeSet<usize>) -> bool {
    splice.number(span).is_some_and(|number| set.contains(&number))
}

/// How much of the lists stays once nobody uses their ends.
struct Tail {
    meshes: usize,
    accessors: usize,
    views: usize,
    end: Option<usize>,
}

impl Tail {
    fn of(splice: &Splice<'_>, old: &Old) -> Self {
        let meshes = splice.list("meshes");
        let mut kept_meshes = meshes.len();
        while kept_meshes > 0 && old.meshes.contains(&(kept_meshes - 1)) {
            kept_meshes -= 1;
        }
        let used_by = |meshes: &[Span]| {
            let mut used = BTreeSet::new();
            for primitive in meshes.iter().flat_map(|mesh| primitives(splice, mesh)) {
                used.extend(number(splice, &primitive, "indices"));
                let mut sets: Vec<Span> = splice.member(&primitive, "attributes").into_iter().collect();
                sets.extend(splice.member(&primitive, "targets").map_or_else(Vec::new, |list| splice.elements(&list)));
                let members = sets.iter().flat_map(|set| splice.members(set));
                used.extend(members.filter_map(|(_, span)| splice.number(&span)));
            }
            used
        };
        let freed = used_by(&meshes[kept_meshes..]);
        let mut used = used_by(&meshes[..kept_meshes]);
        used.extend(splice.list("skins").iter().filter_map(|skin| number(splice, skin, "inverseBindMatrices")));
        for animation in splice.list("animations") {
            let samplers = splice.member(&animation, "samplers").map_or_else(Vec::new, |list| splice.elements(&list));
            used.extend(samplers.iter().flat_map(|s| ["input", "output"].map(|key| number(splice, s, key))).flatten());
        }
        let accessors = splice.list("accessors");
        let goes = |accessor: usize| freed.contains(&accessor) && !used.contains(&accessor);
        let mut kept_accessors = accessors.len();
        while kept_accessors > 0 && goes(kept_accessors - 1) {
            kept_accessors -= 1;
        }

        let views = splice.list("bufferViews");
        let views_of = |accessor: &Span| number(splice, accessor, "bufferView");
        let freed: BTreeSet<usize> = accessors[kept_accessors..].iter().filter_map(views_of).collect();
        let mut used: BTreeSet<usize> = accessors[..kept_accessors].iter().filter_map(views_of).collect();
        for sparse in accessors[..kept_accessors].iter().filter_map(|accessor| splice.member(accessor, "sparse")) {
            let parts = ["indices", "values"].map(|key| splice.member(&sparse, key));
            used.extend(parts.iter().flatten().filter_map(views_of));
        }
        used.extend(splice.list("images").iter().filter_map(views_of));
        let mut kept_views = views.len();
        while kept_views > 0 && freed.contains(&(kept_views - 1)) && !used.contains(&(kept_views - 1)) {
            kept_views -= 1;
        }
        let start = |view: &Span| number(splice, view, "byteOffset").unwrap_or(0);
        let first = views[kept_views..].iter().map(start).min();
        let last = views[..kept_views].iter().map(|view| start(view) + number(splice, view, "byteLength").unwrap_or(0));
        let end = first.filter(|&first| last.max().unwrap_or(0) <= first);
        Self { meshes: kept_meshes, accessors: kept_accessors, views: kept_views, end }
    }
}
