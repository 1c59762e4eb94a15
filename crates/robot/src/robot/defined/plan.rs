//! What of a message is read: the paths of a map, laid over the definition of its type.

use std::collections::BTreeMap;

use super::definition::{Base, Definition, Many};
use crate::error::{Error, Result, failed, suggestion};
use crate::source::{ArrayMap, ArrayPath, Decoder, MapTime, Step};

/// What is taken at a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Take {
    /// Numbers, for the path of this number.
    Values(usize),
    /// A sensor's name.
    Name,
    Time,
}

/// What is wanted of a value and of what lies within it.
#[derive(Clone, Debug, Default)]
pub(super) struct Want {
    pub(super) take: Option<Take>,
    /// By the numbers of fields.
    pub(super) fields: BTreeMap<usize, Want>,
    /// Of items from the first number to before the second.
    pub(super) items: Vec<(usize, usize, Want)>,
}

impl Want {
    /// What is wanted of the item at `index`.
    pub(super) fn item(&self, index: usize) -> Option<&Self> {
        self.items.iter().find(|(first, end, _)| (*first..*end).contains(&index)).map(|(.., want)| want)
    }
}

/// Where the time of a message is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::robot) enum TimePlace {
    /// When it came.
    Arrival,
    /// In the stamp of its header; where that is 0, when it came.
    Stamp,
    /// In a field that the map names, with so many units in a second.
    Named(f64),
}

/// What is read of messages of a type, and how.
pub(in crate::robot) struct Plan {
    pub(super) definition: Definition,
    pub(super) want: Want,
    pub(super) paths: usize,
    pub(super) decoder: Option<Decoder>,
    /// Types that are arrays with a layout, by number.
    pub(super) laid_out: Vec<bool>,
    pub(in crate::robot) time: TimePlace,
    /// Whether the definition has all fields, so that nothing may be left of a message.
    pub(super) is_whole: bool,
}

impl Plan {
    /// What `map` wants of messages of `kind`, which `text` defines; with all of their fields, or those that come first.
    ///
    /// # Errors
    /// The definition is none; a path leads to nothing, or not to numbers.
    pub(in crate::robot) fn new(map: &ArrayMap, kind: &str, text: &str, is_whole: bool) -> Result<Self> {
        let definition = Definition::parse(kind, text)?;
        let mut want = Want::default();
        for (number, path) in map.values.iter().enumerate() {
            let adding = Adding { definition: &definition, take: Take::Values(number), decoder: map.decoder };
            adding.add(&mut want, Base::Message(0), Many::One, path.steps(), &mut String::new())?;
        }
        if let Some(path) = &map.names {
            let adding = Adding { definition: &definition, take: Take::Name, decoder: None };
            let added = adding.add(&mut want, Base::Message(0), Many::One, path.steps(), &mut String::new());
            added.map_err(|e| failed!("names: {e}"))?;
        }
        let adding = Adding { definition: &definition, take: Take::Time, decoder: None };
        let mut add =
            |path: &ArrayPath| adding.add(&mut want, Base::Message(0), Many::One, path.steps(), &mut String::new());
        let time = match &map.time {
            MapTime::Arrival => TimePlace::Arrival,
            MapTime::At(path, per_second) => {
                add(path).map_err(|e| failed!("time: {e}"))?;
                TimePlace::Named(*per_second)
            }
            MapTime::Usual => match add(&"header.stamp".parse()?) {
                Ok(()) => TimePlace::Stamp,
                Err(_) => TimePlace::Arrival,
            },
        };
        let laid_out = (0..definition.types()).map(|number| definition.is_laid_out(number)).collect();
        Ok(Self { want, paths: map.values.len(), decoder: map.decoder, laid_out, time, is_whole, definition })
    }
}

/// Adds one path.
struct Adding<'a> {
    definition: &'a Definition,
    take: Take,
    decoder: Option<Decoder>,
}

impl Adding<'_> {
    /// Adds what `steps` lead to from a value of `base` on, which is at `here`.
    fn add(&self, want: &mut Want, base: Base, many: Many, steps: &[Step], here: &mut String) -> Result<()> {
        let Some((step, rest)) = steps.split_first() else { return self.end(want, base, many, here) };
        match step {
            Step::Field(name) => {
                let Base::Message(number) = base else {
                    return Err(failed!("`{here}` is {} and has no `{name}`", word(base)));
                };
                if many != Many::One {
                    return Err(failed!("`{here}` is an array of messages; write {here}[*].{name}"));
                }
                let own = self.definition.of(number);
                let Some(at) = own.fields.iter().position(|field| field.name == *name) else {
                    let near = suggestion(name, own.fields.iter().map(|field| field.name.as_str()));
                    return Err(failed!("{} has no `{name}`; {near}", own.name));
                };
                if !here.is_empty() {
                    here.push('.');
                }
                here.push_str(name);
                // All values of an array with a layout, as with its name alone.
                let is_all = self.definition.is_laid_out(number) && name == "data" && rest == [Step::All];
                let field = &own.fields[at];
                let rest = if is_all { &[] } else { rest };
                self.add(want.fields.entry(at).or_default(), field.base, field.many, rest, here)
            }
            Step::All | Step::Items(..) => {
                let (first, end) = if let Step::Items(first, end) = step { (*first, *end) } else { (0, usize::MAX) };
                match many {
                    Many::One => return Err(failed!("`{here}` is {}, not an array", word(base))),
                    Many::Array(count) if end != usize::MAX && end > count => {
                        return Err(failed!("`{here}` has {count} items, and [{}] is asked for", end - 1));
                    }
                    Many::Array(_) | Many::Sequence => {}
                }
                let known = want.items.iter().position(|(own, last, _)| (*own, *last) == (first, end));
                if known.is_none() && want.items.iter().any(|(own, last, _)| first < *last && *own < end) {
                    return Err(failed!("items of `{here}` are named twice; name each once"));
                }
                let at = known.unwrap_or_else(|| {
                    want.items.push((first, end, Want::default()));
                    want.items.len() - 1
                });
                here.push_str("[*]");
                self.add(&mut want.items[at].2, base, Many::One, rest, here)
            }
        }
    }

    /// Ends a path at a value of `base`.
    fn end(&self, want: &mut Want, base: Base, many: Many, here: &mut String) -> Result<()> {
        match (self.take, base) {
            (Take::Time, Base::Message(number)) if self.definition.is_time(number) && many == Many::One => {}
            (Take::Time, base) if base.size().is_some() && many == Many::One => {}
            (Take::Time, _) => return Err(failed!("`{here}` is not a time; a number or a stamp is")),
            (Take::Name, Base::Text) if many == Many::One => {}
            (Take::Name, Base::Text) => return Err(failed!("`{here}` is an array of texts; write {here}[*]")),
            (Take::Name, _) => return Err(failed!("`{here}` is {}, not text", word(base))),
            (Take::Values(_), Base::Message(number)) if self.definition.is_laid_out(number) && many == Many::One => {
                return self.add(want, base, many, &[Step::Field("data".to_owned())], here);
            }
            (Take::Values(_), Base::Message(number)) => {
                let own = self.definition.of(number);
                let near = suggestion("", own.fields.iter().map(|field| field.name.as_str()));
                let (what, items) = if many == Many::One { ("a message", "") } else { ("an array of messages", "[*]") };
                return Err(failed!("`{here}` is {what}; go on with {here}{items}.NAME: {near}"));
            }
            (Take::Values(_), Base::Text) if self.decoder.is_some() => {}
            (Take::Values(_), Base::Text | Base::WideText) => {
                return Err(failed!("`{here}` is text; say how numbers are written in it, as decoder = \"hex16\""));
            }
            (Take::Values(_), _) if self.decoder.is_some() && !(base == Base::U8 && many != Many::One) => {
                return Err(failed!("`{here}` is numbers; decoder is for text and bytes, so leave it out"));
            }
            (Take::Values(_), _) => {}
        }
        if want.take.is_some() || !want.items.is_empty() {
            return Err(failed!("`{here}` is named twice; name it once"));
        }
        want.take = Some(self.take);
        Ok(())
    }
}

fn word(base: Base) -> &'static str {
    match base {
        Base::Text | Base::WideText => "text",
        Base::Message(_) => "a message",
        _ => "a number",
    }
}

/// That nothing defines messages of `kind`, in words that begin with `who`.
pub(in crate::robot) fn not_defined(who: &str, kind: &str) -> Error {
    failed!("{who} {kind}; give its .msg in the map: definition = \"NAME.msg\"")
}
