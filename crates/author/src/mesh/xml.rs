//! XML as every format here reads it: checked before a parser sees it, and with line numbers that cost nothing.
//!
//! A parser that recurses overflows the stack where elements are nested too deep, and takes time that grows with the square of
//! the attributes of an element. Both are counted on the text first, in one pass.

use std::path::Path;

use roxmltree::{Document, Node, ParsingOptions};

use crate::error::{Error, Result, failed};
use crate::limits::{self, MAX_XML_ATTRIBUTES, MAX_XML_BYTES, MAX_XML_DEPTH, MAX_XML_NAMESPACES, MAX_XML_NODES};

/// The text of the XML file at `path`.
///
/// # Errors
/// It cannot be read, is too large or is not UTF-8.
pub(super) fn text_of(path: &Path) -> Result<String> {
    limits::read_to_string(path, MAX_XML_BYTES).map_err(|e| Error::io(path, &e))
}

/// `text` as XML.
///
/// # Errors
/// It is not valid, or beyond a limit; with the line.
pub(super) fn parse(text: &str) -> Result<Document<'_>> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    check(text)?;
    let options = ParsingOptions { nodes_limit: MAX_XML_NODES, ..ParsingOptions::default() };
    Document::parse_with_options(text, options).map_err(|e| match e {
        roxmltree::Error::NodesLimitReached => failed!("it has over {MAX_XML_NODES} XML nodes; give a smaller file"),
        _ => failed!("not valid XML: {e}"),
    })
}

/// Counts depth, attributes and namespaces. Text that is not XML is left to the parser, which stops at the same place.
fn check(text: &str) -> Result<()> {
    let bytes = text.as_bytes();
    let after = |from: usize, end: &str| text[from..].find(end).map(|at| from + at + end.len());
    let (mut at, mut depth, mut namespaces) = (0, 0_usize, 0_usize);
    let too_much = |at: usize, what: String| {
        let line = 1 + bytes[..at].iter().filter(|&&byte| byte == b'\n').count();
        Err(Error::failed(what).at(format!("line {line}")))
    };
    while let Some(next) = bytes[at..].iter().position(|&byte| byte == b'<') {
        let start = at + next;
        let rest = &bytes[start + 1..];
        let end = if rest.starts_with(b"!--") {
            after(start + 4, "-->")
        } else if rest.starts_with(b"![CDATA[") {
            after(start + 9, "]]>")
        } else if rest.starts_with(b"?") {
            after(start + 2, "?>")
        } else if rest.starts_with(b"!") {
            let length = Tag::read(rest).length;
            if length.is_none_or(|length| rest[..length].contains(&b'[')) {
                return too_much(start, "its DTD declares entities or more, which is not read; remove it".to_owned());
            }
            length.map(|length| start + 1 + length)
        } else if rest.starts_with(b"/") {
            depth = depth.saturating_sub(1);
            after(start + 2, ">")
        } else {
            let tag = Tag::read(rest);
            namespaces += tag.namespaces;
            if tag.attributes > MAX_XML_ATTRIBUTES {
                return too_much(start, format!("an element of over {MAX_XML_ATTRIBUTES} attributes; remove some"));
            }
            if namespaces > MAX_XML_NAMESPACES {
                return too_much(start, format!("over {MAX_XML_NAMESPACES} `xmlns` attributes; remove some"));
            }
            depth += usize::from(!tag.is_empty);
            if depth > MAX_XML_DEPTH {
                return too_much(start, format!("elements are nested over {MAX_XML_DEPTH} deep; make it flatter"));
            }
            tag.length.map(|length| start + 1 + length)
        };
        match end {
            Some(end) => at = end,
            None => return Ok(()),
        }
    }
    Ok(())
}

/// What is in a start tag.
struct Tag {
    /// In bytes, with its `>`; `None` if that is missing.
    length: Option<usize>,
    attributes: usize,
    namespaces: usize,
    /// Whether it ends its element, too.
    is_empty: bool,
}

impl Tag {
    /// The tag whose `<` is before `bytes`.
    fn read(bytes: &[u8]) -> Self {
        let mut tag = Self { length: None, attributes: 0, namespaces: 0, is_empty: false };
        let mut at = 0;
        let mut word = 0;
        while let Some(&byte) = bytes.get(at) {
            match byte {
                b'>' => {
                    tag.length = Some(at + 1);
                    tag.is_empty = at > 0 && bytes[at - 1] == b'/';
                    break;
                }
                b'=' => {
                    tag.attributes += 1;
                    tag.namespaces += usize::from(bytes[word..at].starts_with(b"xmlns"));
                }
                b'"' | b'\'' => match bytes[at + 1..].iter().position(|&other| other == byte) {
                    Some(length) => at += length + 1,
                    None => break,
                },
                _ if byte.is_ascii_whitespace() => word = at + 1,
                _ => {}
            }
            at += 1;
        }
        tag
    }
}

/// Where the lines of a text begin: a node's line by a search instead of a count from the beginning of the file.
#[derive(Debug)]
pub(super) struct Lines(Vec<usize>);

impl Lines {
    pub(super) fn from_document(document: &Document<'_>) -> Self {
        let ends = document.input_text().bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(at, _)| at + 1);
        Self(std::iter::once(0).chain(ends).collect())
    }

    /// The line of `node`, from 1 on.
    pub(super) fn line(&self, node: Node<'_, '_>) -> u32 {
        self.0.partition_point(|&begin| begin <= node.range().start) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn why(text: &str) -> String {
        parse(text).unwrap_err().to_string()
    }

    #[test]
    fn what_is_too_deep_or_too_wide_is_refused_before_it_is_parsed() {
        let deep = |depth: usize| "<a>\n".repeat(depth) + &"</a>".repeat(depth);
        assert!(parse(&deep(MAX_XML_DEPTH)).is_ok());
        assert_eq!(
            why(&deep(1_000_000)),
            format!("line {}: elements are nested over {MAX_XML_DEPTH} deep; make it flatter", MAX_XML_DEPTH + 1)
        );
        // Nor do comments and quotes hide elements, or look like some.
        let hidden = format!("<a><!-- <a> --><b c='/>' d=\">\"><![CDATA[<a>]]>{}</b></a>", "<c/>".repeat(5000));
        assert!(parse(&hidden).is_ok());
        assert!(why(&format!("<?x <?><!-- > -->{}", deep(100_000))).contains("nested"));
        let wide: String = (0..100_000).map(|index| format!(" a{index}=''")).collect();
        assert!(why(&format!("<a>\n<b{wide}/></a>")).starts_with("line 2: an element of over"));
        let spaces: String = (0..100_000).map(|index| format!("<b\txmlns:a{index}='x'/>")).collect();
        assert!(why(&format!("<a>{spaces}</a>")).contains("`xmlns`"));
        assert!(why("<!DOCTYPE a [<!ENTITY b '<a>'>]><a>&b;</a>").contains("line 1: its DTD declares"));
        assert!(why(&format!("<!DOCTYPE a>{}", deep(100_000))).contains("nested"));
        for broken in ["", "<", "<a", "<a b=\"", "<a>", "</a>", "<!--", "<![CDATA[", "<a><", "<a/></a></a>", "<é>"] {
            assert!(why(broken).starts_with("not valid XML"), "{broken}");
        }
    }

    #[test]
    fn a_line_is_that_of_the_parser() {
        let text = "<a>\n <b/>\n\n <c\n d='1'/><e/>\n</a>";
        let document = parse(text).unwrap();
        let lines = Lines::from_document(&document);
        for node in document.descendants() {
            assert_eq!(lines.line(node), document.text_pos_at(node.range().start).row, "{node:?}");
        }
    }
}
