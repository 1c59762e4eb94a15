//! Values in JSON, by their path.

use serde_json::Value;

use super::decoder::Decoder;
use super::path::{ArrayPath, Step, number_of};
use crate::error::{Result, failed, suggestion};

/// What `value` is, in a word.
fn word(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "true or false",
        Value::Number(_) => "a number",
        Value::String(_) => "text",
        Value::Array(_) => "an array",
        Value::Object(_) => "an object",
    }
}

/// Calls `each` with every value at the steps `rest` of `value`. `here` is the way to it, for messages.
fn walk<'a>(
    value: &'a Value,
    rest: &[Step],
    here: &mut String,
    each: &mut dyn FnMut(&'a Value, &str) -> Result<()>,
) -> Result<()> {
    let Some((step, rest)) = rest.split_first() else { return each(value, here) };
    let length = here.len();
    let place = |here: &str| if here.is_empty() { "the line".to_owned() } else { format!("`{here}`") };
    match (step, value) {
        (Step::Field(name), Value::Object(fields)) => {
            let Some(next) = fields.get(name) else {
                let near = suggestion(name, fields.keys().map(String::as_str));
                return Err(failed!("{} has no `{name}`; {near}", place(here)));
            };
            if length > 0 {
                here.push('.');
            }
            here.push_str(name);
            walk(next, rest, here, each)?;
        }
        (Step::All | Step::Items(..), Value::Array(items)) => {
            let (first, end) = match step {
                Step::Items(first, end) => (*first, *end),
                _ => (0, items.len()),
            };
            let Some(wanted) = items.get(first..end) else {
                return Err(failed!("{} has {} items, and [{}] is asked for", place(here), items.len(), end - 1));
            };
            for (index, item) in wanted.iter().enumerate() {
                here.push_str(&format!("[{}]", first + index));
                walk(item, rest, here, each)?;
                here.truncate(length);
            }
        }
        (Step::All, Value::Object(fields)) => {
            let mut numbered: Vec<_> =
                fields.iter().filter_map(|(name, next)| Some((number_of(name)?, name, next))).collect();
            if numbered.is_empty() {
                return Err(failed!("{} has no fields called by whole numbers", place(here)));
            }
            numbered.sort_unstable_by_key(|&(number, ..)| number);
            for (_, name, next) in numbered {
                if length > 0 {
                    here.push('.');
                }
                here.push_str(name);
                walk(next, rest, here, each)?;
                here.truncate(length);
            }
        }
        (Step::Field(name), other) => return Err(failed!("{} is {} and has no `{name}`", place(here), word(other))),
        (_, other) => return Err(failed!("{} is {}, not an array", place(here), word(other))),
    }
    here.truncate(length);
    Ok(())
}

/// Calls `each` with every number within `value`; `None` where it is null, NaN where it is a word for that.
fn numbers(value: &Value, here: &str, decoder: Option<Decoder>, each: &mut dyn FnMut(Option<f64>)) -> Result<()> {
    match (value, decoder) {
        (Value::String(text), Some(decoder)) => decoder.text(text, |number| each(Some(number))),
        (Value::Array(items), Some(decoder @ Decoder::Bytes { .. })) if items.iter().all(Value::is_number) => {
            let byte = |item: &Value| item.as_u64().and_then(|byte| u8::try_from(byte).ok());
            let bytes = items.iter().map(byte).collect::<Option<Vec<u8>>>();
            let bytes = bytes.ok_or_else(|| failed!("`{here}` has numbers that are no bytes; leave decoder out"))?;
            decoder.bytes(&bytes, |number| each(Some(number)))
        }
        (Value::Array(items), _) => items.iter().try_for_each(|item| numbers(item, here, decoder, each)),
        (_, Some(_)) => Err(failed!("`{here}` is {}; decoder is for text and bytes", word(value))),
        (Value::Null, None) => {
            each(None);
            Ok(())
        }
        (Value::Number(number), None) => {
            each(Some(number.as_f64().unwrap_or(f64::NAN)));
            Ok(())
        }
        (Value::String(text), None) if ["nan", "inf", "-inf"].contains(&text.to_ascii_lowercase().as_str()) => {
            each(Some(f64::NAN));
            Ok(())
        }
        (Value::String(_), None) => {
            Err(failed!("`{here}` is text; say how numbers are written in it, as decoder = \"hex16\""))
        }
        (Value::Object(fields), None) => {
            let near = suggestion("", fields.keys().map(String::as_str));
            Err(failed!("`{here}` is an object; go on with one of its fields: {near}"))
        }
        (Value::Bool(_), None) => Err(failed!("`{here}` is {}, not a number", word(value))),
    }
}

/// Calls `each` with every number at `path` of `message`, in their order. Gives how many there are at each place that the path
/// leads to.
///
/// # Errors
/// There is nothing at the path, or no numbers.
pub(super) fn values(
    message: &Value,
    path: &ArrayPath,
    decoder: Option<Decoder>,
    each: &mut dyn FnMut(Option<f64>),
) -> Result<Vec<usize>> {
    let mut counts = Vec::new();
    walk(message, path.steps(), &mut String::new(), &mut |value, here| {
        let mut count = 0;
        numbers(value, here, decoder, &mut |number| {
            count += 1;
            each(number);
        })?;
        counts.push(count);
        Ok(())
    })?;
    Ok(counts)
}

/// The texts at `path` of `message`, in their order.
///
/// # Errors
/// There is nothing at the path, or something else than texts.
pub(super) fn texts(message: &Value, path: &ArrayPath, each: &mut dyn FnMut(&str)) -> Result<()> {
    walk(message, path.steps(), &mut String::new(), &mut |value, here| match value {
        Value::String(text) => {
            each(text);
            Ok(())
        }
        other => Err(failed!("`{here}` is {}, not text", word(other))),
    })
}

/// The value at `path` of `message`, which has no items.
///
/// # Errors
/// There is nothing.
pub(super) fn one<'a>(message: &'a Value, path: &ArrayPath) -> Result<Option<&'a Value>> {
    let mut found = None;
    walk(message, path.steps(), &mut String::new(), &mut |value, _| {
        found.get_or_insert(value);
        Ok(())
    })?;
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(json: &str, path: &str, decoder: Option<&str>) -> Result<Vec<Option<f64>>> {
        let value: Value = serde_json::from_str(json).unwrap();
        let decoder = decoder.map(|decoder| decoder.parse().unwrap());
        let mut all = Vec::new();
        values(&value, &path.parse().unwrap(), decoder, &mut |number| all.push(number))?;
        Ok(all)
    }

    #[test]
    fn values_come_in_their_order() {
        let json = r#"{"pads":[{"p":[1,2]},{"p":[3,null]},{"p":[[5],["nan"]]}],"hex":"00ff","bytes":[1,0,255,255]}"#;
        let all = read(json, "pads[*].p", None).unwrap();
        assert_eq!(all[..5], [Some(1.0), Some(2.0), Some(3.0), None, Some(5.0)]);
        assert!(all.len() == 6 && all[5].unwrap().is_nan());
        assert_eq!(read(json, "pads[1:2].p[0]", None).unwrap(), [Some(3.0)]);
        assert_eq!(read(json, "hex", Some("hex16")).unwrap(), [Some(255.0)]);
        assert_eq!(read(json, "bytes", Some("i16le")).unwrap(), [Some(1.0), Some(-1.0)]);
        assert_eq!(read("[[1],[2]]", "[*][0]", None).unwrap(), [Some(1.0), Some(2.0)]);
        // Fields called by numbers are items, whatever else there is.
        let numbered = r#"{"message":8,"10":{"p":[5]},"9":{"p":[3,4]},"1x":0}"#;
        assert_eq!(read(numbered, "[*].p", None).unwrap(), [Some(3.0), Some(4.0), Some(5.0)]);
    }

    #[test]
    fn a_path_that_is_wrong_names_the_nearest_field_in_a_line() {
        let json = r#"{"pads":[{"pressure":[1]}],"word":"x","yes":true}"#;
        for (path, says) in [
            ("pad[*].pressure", "the line has no `pad`; did you mean `pads`?"),
            ("pads[*].presure", "`pads[0]` has no `presure`; did you mean `pressure`?"),
            ("pads[1].pressure", "`pads` has 1 items, and [1] is asked for"),
            ("pads.pressure", "`pads` is an array and has no `pressure`"),
            ("word[*]", "`word` is text, not an array"),
            ("[*].p", "the line has no fields called by whole numbers"),
            ("word", "`word` is text; say how"),
            ("yes", "`yes` is true or false, not a number"),
            ("pads", "`pads` is an object; go on with one of its fields"),
        ] {
            let why = read(json, path, None).unwrap_err().to_string();
            assert!(why.contains(says) && why.lines().count() == 1, "{path}: {why}");
        }
    }
}
