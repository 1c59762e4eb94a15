//! Removes an old layout from a user's file.
//!
//! A layout at the end of the lists is removed completely. One between other content is removed as far as references can be
//! renumbered; its meshes and accessors stay, unused.

use std::collections::BTreeSet;

use super::json_edit::{JsonEdit, Span};
use super::layout::{FIELD_KEY, TAXEL_ID};
use super::original::{Original, set_length};
use super::stored_edges::{EDGES_KEY, StoredEdges};
use crate::error::{Result, failed};

/// Prefixes of extensions that do not refer to nodes by number.
const EXTENSIONS_WITHOUT_NODES: [&str; 6] =
    ["KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_mesh_quantization", "MSFT_texture_"];

/// Keys of extras that are of the layout.
const LAYOUT_KEYS: [&str; 2] = [FIELD_KEY, EDGES_KEY];

#[derive(Default)]
struct OldLayout {
    nodes: BTreeSet<usize>,
    /// Layout nodes that are needed otherwise; only their layout data is removed.
    emptied: Vec<usize>,
    /// Meshes of taxels only.
    meshes: BTreeSet<usize>,
    /// Meshes of taxels and other primitives.
    mixed: Vec<usize>,
}

impl Original {
    /// Removes its fields and the edges between its taxels, and unless `keep_taxels` its taxels. Links stay joined.
    ///
    /// # Errors
    /// They cannot be removed, because an extension may refer to later nodes by number.
    pub fn clear_layout(&mut self, keep_taxels: bool) -> Result<()> {
        let joined = joined_links(&JsonEdit::new(&self.text));
        clear_layout(self, keep_taxels).map_err(|e| e.at(&self.name))?;
        if !joined.is_empty() {
            self.set_edges(&StoredEdges { joined, ..StoredEdges::default() });
        }
        Ok(())
    }
}

/// The sets of links that count as one skin.
fn joined_links(edit: &JsonEdit<'_>) -> Vec<Vec<String>> {
    let texts = edit.list("nodes").into_iter().filter_map(|node| {
        let extras = edit.member(&node, "extras")?;
        serde_json::from_str::<String>(edit.get(&edit.member(&extras, EDGES_KEY)?)).ok()
    });
    let texts: Vec<String> = texts.collect();
    // What is no JSON of edges has been a finding.
    StoredEdges::of_nodes(texts.iter()).ok().flatten().map_or_else(Vec::new, |edges| edges.joined)
}

fn clear_layout(original: &mut Original, keep_taxels: bool) -> Result<()> {
    let edit = JsonEdit::new(&original.text);
    let old = find(&edit, keep_taxels);
    if old.nodes.is_empty() && old.emptied.is_empty() && old.mixed.is_empty() {
        return Ok(());
    }
    let count = edit.list("nodes").len();
    let shifts = old.nodes.first().is_some_and(|&first| count - first > old.nodes.len());
    let used = edit.list("extensionsUsed");
    let used = used.iter().map(|span| edit.get(span).trim_matches('"'));
    let numbering_extension =
        used.into_iter().find(|name| !EXTENSIONS_WITHOUT_NODES.iter().any(|known| name.starts_with(known)));
    if let Some(name) = numbering_extension.filter(|_| shifts) {
        return Err(failed!(
            "its old layout lies between nodes that the extension {name} may number; remove the taxels and fields in an \
             editor, or start from the file without them"
        ));
    }
    let text = emptied(edit, &old);
    let (text, end) = without(JsonEdit::new(&text), &old);
    original.text = text;
    if let Some(end) = end {
        original.bin.truncate(end);
    }
    Ok(())
}

fn is_taxels(edit: &JsonEdit<'_>, primitive: &Span) -> bool {
    let attributes = edit.member(primitive, "attributes").map_or_else(Vec::new, |span| edit.members(&span));
    edit.number_in(primitive, "mode") == Some(0)
        && attributes.iter().any(|(key, _)| key.strip_prefix('_') == Some(TAXEL_ID))
}

fn find(edit: &JsonEdit<'_>, keep_taxels: bool) -> OldLayout {
    let (nodes, meshes) = (edit.list("nodes"), edit.list("meshes"));
    let taxels_of = |mesh: &Span| {
        let primitives = edit.list_in(mesh, "primitives");
        let taxels = primitives.iter().filter(|primitive| is_taxels(edit, primitive)).count();
        (taxels, primitives.len())
    };
    let taxels: Vec<(usize, usize)> =
        meshes.iter().map(|mesh| if keep_taxels { (0, 1) } else { taxels_of(mesh) }).collect();
    let all_taxels = |mesh: usize| taxels.get(mesh).is_some_and(|&(taxels, all)| taxels > 0 && taxels == all);
    let mut old = OldLayout {
        mixed: (0..meshes.len()).filter(|&m| taxels[m].0 > 0 && !all_taxels(m)).collect(),
        ..OldLayout::default()
    };
    old.meshes = (0..meshes.len()).filter(|&mesh| all_taxels(mesh)).collect();

    let needed: BTreeSet<usize> = node_numbers(edit).iter().filter_map(|span| edit.number(span)).collect();
    let children: Vec<Vec<usize>> = nodes
        .iter()
        .map(|node| edit.list_in(node, "children").iter().filter_map(|span| edit.number(span)).collect())
        .collect();
    let mut layout = Vec::new();
    for (index, node) in nodes.iter().enumerate() {
        let mesh = edit.number_in(node, "mesh");
        let has = |extras: &Span| LAYOUT_KEYS.iter().any(|key| edit.member(extras, key).is_some());
        let is_field = edit.member(node, "extras").is_some_and(|extras| has(&extras));
        let shows_taxels = mesh.is_some_and(all_taxels);
        if is_field || shows_taxels {
            let free = (mesh.is_none() || shows_taxels) && !needed.contains(&index);
            layout.push((index, free && edit.member(node, "camera").is_none()));
        }
    }
    // A node is removed if all its children are.
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

/// Places of node numbers in skins and animations.
fn node_numbers(edit: &JsonEdit<'_>) -> Vec<Span> {
    let mut spans = Vec::new();
    for skin in edit.list("skins") {
        spans.extend(edit.member(&skin, "skeleton"));
        spans.extend(edit.list_in(&skin, "joints"));
    }
    for animation in edit.list("animations") {
        let channels = edit.list_in(&animation, "channels");
        let targets = channels.iter().filter_map(|channel| edit.member(channel, "target"));
        spans.extend(targets.filter_map(|target| edit.member(&target, "node")));
    }
    spans
}

/// The text without the layout data of nodes and meshes that stay.
fn emptied(mut edit: JsonEdit<'_>, old: &OldLayout) -> String {
    let (nodes, meshes) = (edit.list("nodes"), edit.list("meshes"));
    for &index in &old.emptied {
        let shows_taxels = edit.number_in(&nodes[index], "mesh").is_some_and(|mesh| old.meshes.contains(&mesh));
        if shows_taxels {
            edit.remove_members(&nodes[index], |key| key == "mesh" || key == "skin");
        }
        if let Some(extras) = edit.member(&nodes[index], "extras") {
            edit.remove_members(&extras, |key| LAYOUT_KEYS.contains(&key));
        }
    }
    for &index in &old.mixed {
        let all = edit.list_in(&meshes[index], "primitives");
        let gone: Vec<bool> = all.iter().map(|primitive| is_taxels(&edit, primitive)).collect();
        if let Some(list) = edit.member(&meshes[index], "primitives") {
            edit.remove_elements(&list, |i| gone[i]);
        }
    }
    edit.apply()
}

/// The text without `old`, and the new end of the buffer, if it is shorter.
fn without(mut edit: JsonEdit<'_>, old: &OldLayout) -> (String, Option<usize>) {
    let root = edit.root();
    let nodes = edit.list("nodes");
    let new_number = |node: usize| node - old.nodes.range(..node).count();
    let renumber = |edit: &mut JsonEdit<'_>, span: Span| {
        if let Some(node) = edit.number(&span).filter(|&node| new_number(node) != node && !old.nodes.contains(&node)) {
            edit.replace(span, new_number(node).to_string());
        }
    };
    for span in node_numbers(&edit) {
        renumber(&mut edit, span);
    }
    let owners =
        nodes.iter().enumerate().filter(|(index, _)| !old.nodes.contains(index)).map(|(_, node)| (node, "children"));
    let scenes = edit.list("scenes");
    for (owner, key) in owners.chain(scenes.iter().map(|scene| (scene, "nodes"))) {
        let Some(list) = edit.member(owner, key) else { continue };
        let elements = edit.elements(&list);
        let goes = |span: &Span| edit.number(span).is_some_and(|node| old.nodes.contains(&node));
        let gone: Vec<bool> = elements.iter().map(goes).collect();
        if gone.iter().all(|&gone| gone) {
            // glTF allows no empty list.
            edit.remove_members(owner, |member| member == key);
            continue;
        }
        edit.remove_elements(&list, |i| gone[i]);
        for span in elements {
            renumber(&mut edit, span);
        }
    }
    let tail = Tail::from_edit(&edit, old);
    let mut emptied = Vec::new();
    for (key, kept) in [("meshes", tail.meshes), ("accessors", tail.accessors), ("bufferViews", tail.views)] {
        let Some(list) = edit.member(&root, key) else { continue };
        match kept {
            0 => emptied.push(key),
            kept => edit.remove_elements(&list, |i| i >= kept),
        }
    }
    if let Some(list) = edit.member(&root, "nodes") {
        match nodes.len() == old.nodes.len() {
            true => emptied.push("nodes"),
            false => edit.remove_elements(&list, |i| old.nodes.contains(&i)),
        }
    }
    match tail.end {
        Some(0) => emptied.push("buffers"),
        Some(end) => set_length(&mut edit, end),
        None => {}
    }
    edit.remove_members(&root, |key| emptied.contains(&key));
    (edit.apply(), tail.end)
}

/// The lengths of the lists without unused elements at their ends.
struct Tail {
    meshes: usize,
    accessors: usize,
    views: usize,
    end: Option<usize>,
}

impl Tail {
    fn from_edit(edit: &JsonEdit<'_>, old: &OldLayout) -> Self {
        let meshes = edit.list("meshes");
        let without_end = |length: usize, goes: &dyn Fn(usize) -> bool| {
            (0..length).rposition(|index| !goes(index)).map_or(0, |last| last + 1)
        };
        let kept_meshes = without_end(meshes.len(), &|mesh| old.meshes.contains(&mesh));
        let used_by = |meshes: &[Span]| {
            let mut used = BTreeSet::new();
            for primitive in meshes.iter().flat_map(|mesh| edit.list_in(mesh, "primitives")) {
                used.extend(edit.number_in(&primitive, "indices"));
                let mut sets: Vec<Span> = edit.member(&primitive, "attributes").into_iter().collect();
                sets.extend(edit.list_in(&primitive, "targets"));
                let members = sets.iter().flat_map(|set| edit.members(set));
                used.extend(members.filter_map(|(_, span)| edit.number(&span)));
            }
            used
        };
        let freed = used_by(&meshes[kept_meshes..]);
        let mut used = used_by(&meshes[..kept_meshes]);
        used.extend(edit.list("skins").iter().filter_map(|skin| edit.number_in(skin, "inverseBindMatrices")));
        for animation in edit.list("animations") {
            let samplers = edit.list_in(&animation, "samplers");
            used.extend(samplers.iter().flat_map(|s| ["input", "output"].map(|key| edit.number_in(s, key))).flatten());
        }
        let accessors = edit.list("accessors");
        let goes = |accessor: usize| freed.contains(&accessor) && !used.contains(&accessor);
        let kept_accessors = without_end(accessors.len(), &goes);

        let views = edit.list("bufferViews");
        let views_of = |accessor: &Span| edit.number_in(accessor, "bufferView");
        let freed: BTreeSet<usize> = accessors[kept_accessors..].iter().filter_map(views_of).collect();
        let mut used: BTreeSet<usize> = accessors[..kept_accessors].iter().filter_map(views_of).collect();
        for sparse in accessors[..kept_accessors].iter().filter_map(|accessor| edit.member(accessor, "sparse")) {
            let parts = ["indices", "values"].map(|key| edit.member(&sparse, key));
            used.extend(parts.iter().flatten().filter_map(views_of));
        }
        used.extend(edit.list("images").iter().filter_map(views_of));
        let kept_views = without_end(views.len(), &|view| freed.contains(&view) && !used.contains(&view));
        let start = |view: &Span| edit.number_in(view, "byteOffset").unwrap_or(0);
        let first = views[kept_views..].iter().map(start).min();
        let last = views[..kept_views].iter().map(|view| start(view) + edit.number_in(view, "byteLength").unwrap_or(0));
        let end = first.filter(|&first| last.max().unwrap_or(0) <= first);
        Self { meshes: kept_meshes, accessors: kept_accessors, views: kept_views, end }
    }
}
