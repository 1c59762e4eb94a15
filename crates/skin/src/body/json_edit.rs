//! Edits JSON as text, so that unchanged parts keep every byte.

use std::fmt;
use std::ops::Range;

use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::value::RawValue;

/// A range of bytes in the text.
pub(super) type Span = Range<usize>;

struct Members<'a>(Vec<(String, &'a RawValue)>);

impl<'de> Deserialize<'de> for Members<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Collect;
        impl<'de> Visitor<'de> for Collect {
            type Value = Members<'de>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut members = Vec::new();
                while let Some(member) = map.next_entry()? {
                    members.push(member);
                }
                Ok(Members(members))
            }
        }
        deserializer.deserialize_map(Collect)
    }
}

/// A text and its changes, which must not overlap.
pub(super) struct JsonEdit<'a> {
    text: &'a str,
    changes: Vec<(Span, String)>,
}

impl<'a> JsonEdit<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self { text, changes: Vec::new() }
    }

    /// The whole text's value, without the blanks around it.
    pub(super) fn root(&self) -> Span {
        let start = self.text.len() - self.text.trim_start().len();
        start..self.text.trim_end().len()
    }

    fn span(&self, raw: &RawValue) -> Span {
        let start = raw.get().as_ptr() as usize - self.text.as_ptr() as usize;
        start..start + raw.get().len()
    }

    pub(super) fn get(&self, span: &Span) -> &'a str {
        &self.text[span.clone()]
    }

    /// The members of the object at `span`; none where there is no object.
    pub(super) fn members(&self, span: &Span) -> Vec<(String, Span)> {
        let members = serde_json::from_str::<Members<'a>>(self.get(span)).map(|members| members.0);
        members.unwrap_or_default().into_iter().map(|(key, raw)| (key, self.span(raw))).collect()
    }

    pub(super) fn member(&self, span: &Span, key: &str) -> Option<Span> {
        self.members(span).into_iter().rev().find(|(known, _)| known == key).map(|(_, span)| span)
    }

    /// The elements of the list at `span`; none where there is no list.
    pub(super) fn elements(&self, span: &Span) -> Vec<Span> {
        let elements: Vec<&'a RawValue> = serde_json::from_str(self.get(span)).unwrap_or_default();
        elements.into_iter().map(|raw| self.span(raw)).collect()
    }

    /// The elements of the list that is the member `key` of the root.
    pub(super) fn list(&self, key: &str) -> Vec<Span> {
        self.list_in(&self.root(), key)
    }

    /// The elements of the list that is the member `key` of the object at `span`.
    pub(super) fn list_in(&self, span: &Span, key: &str) -> Vec<Span> {
        self.member(span, key).map_or_else(Vec::new, |list| self.elements(&list))
    }

    pub(super) fn number(&self, span: &Span) -> Option<usize> {
        self.get(span).parse().ok()
    }

    /// The whole number that is the member `key` of the object at `span`.
    pub(super) fn number_in(&self, span: &Span, key: &str) -> Option<usize> {
        self.number(&self.member(span, key)?)
    }

    pub(super) fn replace(&mut self, span: Span, with: String) {
        self.changes.push((span, with));
    }

    /// Adds `elements` to the end of the list at `span`.
    fn append(&mut self, span: &Span, elements: &[String]) {
        if !elements.is_empty() {
            let first = if self.elements(span).is_empty() { "" } else { "," };
            self.changes.push((span.end - 1..span.end - 1, format!("{first}{}", elements.join(","))));
        }
    }

    /// Adds `elements` to the end of the list that is the member `key` of the object at `span`, which is created if needed.
    pub(super) fn append_to(&mut self, span: &Span, key: &str, elements: &[String]) {
        match self.member(span, key) {
            Some(list) => self.append(&list, elements),
            None if elements.is_empty() => {}
            None => self.extend(span, &[(key.to_owned(), format!("[{}]", elements.join(",")))]),
        }
    }

    pub(super) fn set(&mut self, span: &Span, key: &str, value: String) {
        match self.member(span, key) {
            Some(old) => self.replace(old, value),
            None => self.extend(span, &[(key.to_owned(), value)]),
        }
    }

    /// Adds `members` (key, value), which it must not have, to the object at `span`.
    pub(super) fn extend(&mut self, span: &Span, members: &[(String, String)]) {
        if !members.is_empty() {
            let written: Vec<String> = members.iter().map(|(key, value)| format!("\"{key}\":{value}")).collect();
            let first = if self.members(span).is_empty() { "" } else { "," };
            self.changes.push((span.end - 1..span.end - 1, format!("{first}{}", written.join(","))));
        }
    }

    /// Removes the parts `gone` of `all`, the members (with their keys) or elements of the value at `span`.
    fn cut(&mut self, span: &Span, all: &[Span], gone: impl Fn(usize) -> bool) {
        let indices: Vec<usize> = (0..all.len()).collect();
        for run in indices.chunk_by(|&a, &b| gone(a) == gone(b)).filter(|run| gone(run[0])) {
            let (first, last) = (run[0], run[run.len() - 1]);
            // From the end of what stays before to the end of what goes, or at the start to the start of what stays.
            let (start, end) = match (first.checked_sub(1), all.get(last + 1)) {
                (Some(before), _) => (all[before].end, all[last].end),
                (None, Some(after)) => (all[first].start, after.start),
                (None, None) => (span.start + 1, span.end - 1),
            };
            self.changes.push((start..end, String::new()));
        }
    }

    pub(super) fn remove_elements(&mut self, span: &Span, gone: impl Fn(usize) -> bool) {
        let all = self.elements(span);
        self.cut(span, &all, gone);
    }

    /// The members of the object at `span`, each with its key.
    fn members_with_keys(&self, span: &Span) -> Vec<(String, Span)> {
        // A member begins with its key, after the brace or the comma before it.
        let mut from = span.start + 1;
        let with_key = |(key, value): (String, Span)| {
            let between = &self.text[from..value.start];
            let start = from + between.find('"').unwrap_or(0);
            from = value.end;
            (key, start..value.end)
        };
        self.members(span).into_iter().map(with_key).collect()
    }

    /// The member `key` of the object at `span`, from its key on.
    pub(super) fn member_with_key(&self, span: &Span, key: &str) -> Option<Span> {
        self.members_with_keys(span).into_iter().rev().find(|(known, _)| known == key).map(|(_, span)| span)
    }

    /// Removes the members called `gone` of the object at `span`.
    pub(super) fn remove_members(&mut self, span: &Span, gone: impl Fn(&str) -> bool) {
        let (keys, all): (Vec<String>, Vec<Span>) = self.members_with_keys(span).into_iter().unzip();
        self.cut(span, &all, |i| gone(&keys[i]));
    }

    pub(super) fn apply(mut self) -> String {
        self.changes.sort_by_key(|(span, _)| (span.start, span.end));
        let mut out = String::with_capacity(self.text.len());
        let mut from = 0;
        for (span, with) in &self.changes {
            out += &self.text[from..span.start.max(from)];
            out += with;
            from = span.end.max(from);
        }
        out + &self.text[from..]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "{ \"a\": [1.00, 2e-7 ,3],\n\t\"b\" : {\"x\":0.10, \"y\": -0},\"c\":[ ] }\n";

    #[test]
    fn what_is_not_changed_keeps_its_bytes() {
        let edit = JsonEdit::new(TEXT);
        assert_eq!(edit.list("a").iter().map(|span| edit.get(span)).collect::<Vec<_>>(), ["1.00", "2e-7", "3"]);
        assert_eq!(edit.apply(), TEXT);
        let mut edit = JsonEdit::new(TEXT);
        let root = edit.root();
        let [a, b, c] = ["a", "b", "c"].map(|key| edit.member(&root, key).unwrap());
        edit.append(&a, &["4".into(), "5".into()]);
        edit.append(&c, &["6".into()]);
        edit.extend(&b, &[("z".into(), "[]".into())]);
        edit.extend(&root, &[("d".into(), "7".into()), ("e".into(), "8".into())]);
        let expected =
            "{ \"a\": [1.00, 2e-7 ,3,4,5],\n\t\"b\" : {\"x\":0.10, \"y\": -0,\"z\":[]},\"c\":[ 6] ,\"d\":7,\"e\":8}\n";
        assert_eq!(edit.apply(), expected);
    }

    #[test]
    fn what_goes_takes_its_comma_along() {
        let without = |gone: &[usize]| {
            let mut edit = JsonEdit::new(TEXT);
            let a = edit.member(&edit.root(), "a").unwrap();
            edit.remove_elements(&a, |i| gone.contains(&i));
            let text = edit.apply();
            serde_json::from_str::<serde_json::Value>(&text).unwrap()["a"].to_string()
        };
        assert_eq!(without(&[0]), "[2e-7,3]");
        assert_eq!([without(&[1]), without(&[2])], ["[1.0,3]", "[1.0,2e-7]"]);
        assert_eq!([without(&[0, 2]), without(&[0, 1]), without(&[1, 2])], ["[2e-7]", "[3]", "[1.0]"]);
        assert_eq!(without(&[0, 1, 2]), "[]");
        for (gone, left) in [
            ("a", "{\"b\":{\"x\":0.1,\"y\":-0.0},\"c\":[]}"),
            ("c", "{\"a\":[1.0,2e-7,3],\"b\":{\"x\":0.1,\"y\":-0.0}}"),
        ] {
            let mut edit = JsonEdit::new(TEXT);
            let root = edit.root();
            edit.remove_members(&root, |key| key == gone);
            assert_eq!(serde_json::from_str::<serde_json::Value>(&edit.apply()).unwrap().to_string(), left);
        }
    }
}
