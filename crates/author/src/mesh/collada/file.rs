//! A COLLADA document, whose elements are found by what they are and by `id`.

use std::collections::HashMap;

use roxmltree::{Document, Node};

use crate::error::{Error, Result};
use crate::mesh::xml::Lines;

/// A document, with its elements by what they are and by `id`.
pub(super) struct File<'a> {
    by_id: HashMap<(&'a str, &'a str), Node<'a, 'a>>,
    lines: Lines,
}

impl<'a> File<'a> {
    pub(super) fn from_document(document: &'a Document<'a>) -> Self {
        let mut by_id = HashMap::new();
        for node in document.descendants() {
            if let Some(id) = node.attribute("id") {
                by_id.entry((node.tag_name().name(), id)).or_insert(node);
            }
        }
        Self { by_id, lines: Lines::from_document(document) }
    }

    pub(super) fn at(&self, node: Node<'_, '_>, what: impl Into<String>) -> Error {
        Error::failed(format!("not a valid COLLADA mesh: {}", what.into()))
            .at(format!("line {}", self.lines.line(node)))
    }

    /// The element `tag` that the attribute `key` of `node` names.
    pub(super) fn named(&self, node: Node<'a, 'a>, key: &str, tag: &'static str) -> Result<Node<'a, 'a>> {
        let missing = || self.at(node, format!("<{}> has no `{key}`", node.tag_name().name()));
        let url = node.attribute(key).ok_or_else(missing)?;
        let Some(id) = url.strip_prefix('#') else {
            return Err(self.at(node, format!("`{url}` is in another file; export all into one")));
        };
        let unknown = || self.at(node, format!("there is no <{tag}> called `{id}`; export it again"));
        self.by_id.get(&(tag, id)).copied().ok_or_else(unknown)
    }
}
