//! Texts and lists of texts in YAML, as recorders and people write these. What is written in another way is refused.

use crate::error::{Error, Result, failed};

/// The value of `key`, a text on one line; `None` where there is no such key.
pub(super) fn value(text: &str, key: &str) -> Result<Option<String>> {
    let Some((value, _)) = after(text, key)? else { return Ok(None) };
    let (value, rest) = scalar(value, "")?;
    end(rest).map_err(|e| e.at(key))?;
    Ok(Some(value))
}

/// The texts that `key` lists, on lines after `- ` or between brackets.
pub(super) fn listed(text: &str, key: &str) -> Result<Vec<String>> {
    let Some((value, rest)) = after(text, key)? else { return Err(failed!("it has no {key}")) };
    let list = match value.trim_start().strip_prefix('[') {
        Some(_) => {
            // Up to the end of the text: a list between brackets may go over many lines.
            let at = text.len() - rest.len() - value.len();
            flow(text[at..].trim_start().strip_prefix('[').unwrap_or_default())
        }
        None => end(value).and_then(|()| block(rest)),
    };
    list.map_err(|e| failed!("{key} is written in a way that is not read here: {e}"))
}

/// What follows `key`, which is there once at most, on its line; and what comes after that line.
fn after<'a>(text: &'a str, key: &str) -> Result<Option<(&'a str, &'a str)>> {
    let mut found = None;
    let mut rest = text;
    while !rest.is_empty() {
        let (line, next) = rest.split_once('\n').unwrap_or((rest, ""));
        let line = line.strip_suffix('\r').unwrap_or(line);
        if let Some(value) = line.trim_start().strip_prefix(key).and_then(|value| value.strip_prefix(':'))
            && found.replace((value, next)).is_some()
        {
            return Err(failed!("it has {key} twice"));
        }
        rest = next;
    }
    Ok(found)
}

/// Checks that nothing but a comment follows on a line.
fn end(rest: &str) -> Result<()> {
    match rest.trim_start() {
        "" => Ok(()),
        comment if comment.starts_with('#') && comment.len() < rest.len() => Ok(()),
        other => Err(failed!("`{}` is not understood", other.chars().take(40).collect::<String>())),
    }
}

/// The text that `from` begins with, and what follows it; one without quotes ends before any of `ends`, too.
fn scalar<'a>(from: &'a str, ends: &str) -> Result<(String, &'a str)> {
    let from = from.trim_start();
    if let Some(quoted) = from.strip_prefix('\'') {
        let mut text = String::new();
        let mut rest = quoted;
        while let Some((part, after)) = rest.split_once('\'') {
            text += part;
            match after.strip_prefix('\'') {
                Some(more) => {
                    text.push('\'');
                    rest = more;
                }
                None => return Ok((text, after)),
            }
        }
        return Err(Error::failed("a quote has no end"));
    }
    if from.starts_with('"') {
        // A string of JSON is one of YAML.
        let mut texts = serde_json::Deserializer::from_str(from).into_iter::<String>();
        let text = texts.next().and_then(std::result::Result::ok);
        return match text {
            Some(text) => Ok((text, &from[texts.byte_offset()..])),
            None => Err(Error::failed("a quoted text is not one of JSON")),
        };
    }
    let comment = from.find(" #").unwrap_or(from.len());
    let line = from.find('\n').unwrap_or(from.len());
    let length = from.find(|sign| ends.contains(sign)).unwrap_or(from.len()).min(comment).min(line);
    let (text, rest) = (from[..length].trim_end(), &from[length..]);
    let is_special = |sign: char| "&*!|>%@`{}[],?#\"\'".contains(sign);
    if text.starts_with(is_special) || text.contains(": ") || text.ends_with(':') || text == "~" || text == "-" {
        return Err(failed!("`{}` is not understood", text.chars().take(40).collect::<String>()));
    }
    Ok((text.to_owned(), rest))
}

/// The texts of lines after `- ` at the beginning of `text`.
fn block(text: &str) -> Result<Vec<String>> {
    let mut texts = Vec::new();
    let mut indent = 0;
    for line in text.lines() {
        let words = line.trim();
        if words.is_empty() || words.starts_with('#') {
            continue;
        }
        let own = line.len() - line.trim_start().len();
        let Some(item) = words.strip_prefix("- ").filter(|_| texts.is_empty() || own == indent) else {
            // Something deeper than the list goes on with its last text.
            return match own > indent && !texts.is_empty() || words == "-" {
                true => Err(failed!("`{}` is not understood", words.chars().take(40).collect::<String>())),
                false => Ok(texts),
            };
        };
        indent = own;
        let (text, rest) = scalar(item, "")?;
        end(rest)?;
        if text.is_empty() {
            return Err(Error::failed("an entry is empty"));
        }
        texts.push(text);
    }
    Ok(texts)
}

/// The texts of a list between brackets, after the first of these.
fn flow(text: &str) -> Result<Vec<String>> {
    let mut texts = Vec::new();
    let mut rest = blank(text);
    loop {
        if let Some(after) = rest.strip_prefix(']') {
            end(after.split('\n').next().unwrap_or_default())?;
            return Ok(texts);
        }
        let (text, after) = scalar(rest, ",]")?;
        if text.is_empty() {
            return Err(Error::failed("an entry is empty, or a bracket has no end"));
        }
        texts.push(text);
        rest = blank(after);
        match rest.strip_prefix(',') {
            Some(after) => rest = blank(after),
            None if rest.starts_with(']') => {}
            None => return Err(Error::failed("a comma or a bracket is missing")),
        }
    }
}

/// `text` after blanks, ends of lines and comments.
fn blank(mut text: &str) -> &str {
    loop {
        text = text.trim_start();
        match text.strip_prefix('#') {
            Some(comment) => text = comment.split_once('\n').map_or("", |(_, rest)| rest),
            None => return text,
        }
    }
}
