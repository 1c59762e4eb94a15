//! Which files of the crate use items of which other files, as the compiler would find it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use syn::visit::Visit;

/// How often an item is handed on, at most.
const MOST_EXPORTS: usize = 8;

/// A module's path, from the crate's root.
type Module = Vec<String>;

/// The files of `src/`, and what each names.
pub struct Paths {
    files: BTreeMap<Module, PathBuf>,
    /// By module, names that it takes from elsewhere for others to use.
    exports: BTreeMap<Module, BTreeMap<String, Named>>,
    /// By module, paths that it names, each from the module that it stands in.
    named: BTreeMap<Module, Vec<Named>>,
}

/// A path, and the module that it stands in.
#[derive(Clone, Debug)]
struct Named {
    within: Module,
    segments: Vec<String>,
}

impl Paths {
    /// The paths of `files`, given by path within `src/` with their text.
    pub fn from_files(files: impl IntoIterator<Item = (PathBuf, String)>) -> Self {
        let files: Vec<(PathBuf, String)> = files.into_iter().collect();
        let by_module = files.iter().map(|(path, _)| (module_of(path), path.clone())).collect();
        let mut paths = Self { files: by_module, exports: BTreeMap::new(), named: BTreeMap::new() };
        for (path, text) in &files {
            paths.add(module_of(path), text);
        }
        paths
    }

    /// Adds what `text`, the file of `module`, names.
    fn add(&mut self, module: Module, text: &str) {
        let parsed = syn::parse_file(text).unwrap_or_else(|e| panic!("{module:?}: {e}"));
        let mut reader = Reader { within: module.clone(), exports: BTreeMap::new(), named: Vec::new() };
        reader.visit_file(&parsed);
        self.exports.insert(module.clone(), reader.exports);
        self.named.insert(module, reader.named);
    }

    /// By file, the files that an item which it uses is of; of one that a module takes from elsewhere and hands on, the
    /// module's with `as_handed_on`, else where it comes from.
    pub fn uses(&self, as_handed_on: bool) -> BTreeMap<&Path, BTreeSet<&Path>> {
        let of = |(module, named): (&Module, &Vec<Named>)| {
            let own = self.files[module].as_path();
            let used = named
                .iter()
                .filter_map(|named| self.file_of(named, if as_handed_on { MOST_EXPORTS } else { 0 }))
                .filter(|file| *file != own);
            (own, used.collect())
        };
        self.named.iter().map(of).collect()
    }

    /// The file that has what is `named`, if it is of this crate.
    fn file_of(&self, named: &Named, depth: usize) -> Option<&Path> {
        let mut rest = named.segments.as_slice();
        let mut module = match rest.first()?.as_str() {
            // The command, which is not of the library, names that.
            "crate" | "somatic" => Vec::new(),
            "self" | "super" => named.within.clone(),
            child => {
                let path = [&named.within[..], &[child.to_owned()]].concat();
                self.files.contains_key(&path).then(|| named.within.clone())?
            }
        };
        while let Some(first) = rest.first() {
            match first.as_str() {
                // `somatic::internal` has the rooms of the house by their own names.
                "crate" | "somatic" | "internal" | "self" => {}
                "super" => {
                    module.pop();
                }
                _ => break,
            }
            rest = &rest[1..];
        }
        while let Some(next) = rest.first() {
            let deeper = [&module[..], std::slice::from_ref(next)].concat();
            if !self.files.contains_key(&deeper) {
                break;
            }
            (module, rest) = (deeper, &rest[1..]);
        }
        // Modules within a file are the file.
        while !self.files.contains_key(&module) {
            module.pop()?;
        }
        let export = rest.first().and_then(|name| self.exports.get(&module)?.get(name));
        match export.filter(|_| depth < MOST_EXPORTS) {
            Some(export) => self.file_of(export, depth + 1).or(self.files.get(&module).map(PathBuf::as_path)),
            None => self.files.get(&module).map(PathBuf::as_path),
        }
    }
}

/// The module that the file at `path` within `src` is.
fn module_of(path: &Path) -> Module {
    let mut module: Module = path.with_extension("").iter().map(|part| part.to_str().unwrap().to_owned()).collect();
    if matches!(module.last().map(String::as_str), Some("mod" | "lib")) {
        module.pop();
    }
    module
}

/// Collects the paths of a file, but for those of its tests.
struct Reader {
    within: Module,
    exports: BTreeMap<String, Named>,
    named: Vec<Named>,
}

fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        syn::Meta::List(list) => list.path.is_ident("cfg") && list.tokens.to_string() == "test",
        meta => meta.path().is_ident("test"),
    })
}

impl Reader {
    fn name(&mut self, segments: Vec<String>) {
        // Alone, a word such as `crate` is no item.
        if segments.iter().all(|segment| ["crate", "self", "super"].contains(&segment.as_str())) {
            return;
        }
        self.named.push(Named { within: self.within.clone(), segments });
    }

    /// The paths of a `use`, with the name that each has here.
    fn flattened(tree: &syn::UseTree, before: &[String], found: &mut Vec<(String, Vec<String>)>) {
        let then = |ident: &syn::Ident| [before, &[ident.to_string()]].concat();
        match tree {
            syn::UseTree::Path(path) => Self::flattened(&path.tree, &then(&path.ident), found),
            syn::UseTree::Name(name) if name.ident == "self" => {
                found.push((before.last().cloned().unwrap_or_default(), before.to_vec()));
            }
            syn::UseTree::Name(name) => found.push((name.ident.to_string(), then(&name.ident))),
            syn::UseTree::Rename(name) => found.push((name.rename.to_string(), then(&name.ident))),
            syn::UseTree::Glob(_) => found.push(("*".to_owned(), before.to_vec())),
            syn::UseTree::Group(group) => group.items.iter().for_each(|tree| Self::flattened(tree, before, found)),
        }
    }

    /// Paths among the words of a macro's call.
    fn words(&mut self, tokens: proc_macro2::TokenStream) {
        let mut path: Vec<String> = Vec::new();
        let mut colons = 0;
        for token in tokens {
            match token {
                proc_macro2::TokenTree::Ident(ident) => {
                    if colons != 2 {
                        self.name(std::mem::take(&mut path));
                    }
                    path.push(ident.to_string());
                    colons = 0;
                }
                proc_macro2::TokenTree::Punct(punct) if punct.as_char() == ':' => colons += 1,
                other => {
                    self.name(std::mem::take(&mut path));
                    colons = 0;
                    if let proc_macro2::TokenTree::Group(group) = other {
                        self.words(group.stream());
                    }
                }
            }
        }
        self.name(path);
    }
}

impl<'a> Visit<'a> for Reader {
    fn visit_item(&mut self, item: &'a syn::Item) {
        let attributes = match item {
            syn::Item::Mod(item) => &item.attrs,
            syn::Item::Fn(item) => &item.attrs,
            syn::Item::Use(item) => &item.attrs,
            syn::Item::Impl(item) => &item.attrs,
            syn::Item::Const(item) => &item.attrs,
            _ => return syn::visit::visit_item(self, item),
        };
        if !is_test(attributes) {
            syn::visit::visit_item(self, item);
        }
    }

    fn visit_impl_item_fn(&mut self, item: &'a syn::ImplItemFn) {
        if !is_test(&item.attrs) {
            syn::visit::visit_impl_item_fn(self, item);
        }
    }

    fn visit_item_mod(&mut self, item: &'a syn::ItemMod) {
        if item.content.is_some() {
            self.within.push(item.ident.to_string());
            syn::visit::visit_item_mod(self, item);
            self.within.pop();
        }
    }

    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        let mut found = Vec::new();
        Self::flattened(&item.tree, &[], &mut found);
        let is_export = !matches!(item.vis, syn::Visibility::Inherited);
        for (name, segments) in found {
            if is_export {
                self.exports.insert(name, Named { within: self.within.clone(), segments });
            } else {
                self.name(segments);
            }
        }
    }

    /// `pub(super)` uses nothing.
    fn visit_vis_restricted(&mut self, _: &'a syn::VisRestricted) {}

    fn visit_path(&mut self, path: &'a syn::Path) {
        self.name(path.segments.iter().map(|segment| segment.ident.to_string()).collect());
        syn::visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'a syn::Macro) {
        self.words(call.tokens.clone());
    }
}

/// Files that use each other, if there are any: each uses the next, and the last the first.
pub fn circle<'a>(uses: &BTreeMap<&'a Path, BTreeSet<&'a Path>>) -> Option<Vec<&'a Path>> {
    fn walk<'a>(
        at: &'a Path,
        uses: &BTreeMap<&'a Path, BTreeSet<&'a Path>>,
        done: &mut BTreeSet<&'a Path>,
        way: &mut Vec<&'a Path>,
    ) -> Option<Vec<&'a Path>> {
        if let Some(start) = way.iter().position(|file| *file == at) {
            return Some(way[start..].to_vec());
        }
        if done.contains(at) {
            return None;
        }
        way.push(at);
        let found = uses.get(at).into_iter().flatten().find_map(|next| walk(next, uses, done, way));
        way.pop();
        done.insert(at);
        found
    }
    let mut done = BTreeSet::new();
    uses.keys().find_map(|file| walk(file, uses, &mut done, &mut Vec::new()))
}
