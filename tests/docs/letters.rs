//! The README's table of four letters: each of its figures is what the command above it writes.

use std::ops::Range;

use serde_json::Value;

use super::{commands, root, shell, workplace};

/// A figure: its key, and how many of the README's units are one of its own.
type Figure = (&'static str, f64);

/// By letter: what it is told of, a field or, without one, the only touch of that time; and what its figures are, in their order.
const FIGURES: [(&str, Option<&str>, &[Figure]); 4] = [
    ("proximity", Some("hand/palm"), &[("nearest", 1e3), ("approach_speed", 1.0)]),
    ("sustained", None, &[("id", 1.0), ("force", 1.0)]),
    ("temperature", None, &[("id", 1.0), ("temperature", 1.0), ("warmest", 1.0), ("temperature_rate", 1.0)]),
    ("shear", None, &[("id", 1.0), ("shear", 1.0), ("friction", 1.0), ("slip_ratio", 100.0)]),
];

/// The line of the time `t_s`.
fn line(lines: &[Value], t_s: f64) -> &Value {
    lines.iter().find(|line| line["t"] == t_s).unwrap_or_else(|| panic!("no line of {t_s} s"))
}

/// The only touch of a line.
fn touch(line: &Value) -> &Value {
    let [touch] = &line["touches"].as_array().unwrap()[..] else { panic!("one touch: {line}") };
    touch
}

/// The percept of a field in a line.
fn percept<'a>(line: &'a Value, field: &str, letter: &str) -> &'a Value {
    let mut fields = line["fields"].as_array().unwrap().iter();
    fields.find(|own| own["field"] == field && own["letter"] == letter).unwrap_or_else(|| panic!("{field}: {line}"))
}

/// The number at `key`, or the length of the vector there.
fn size(of: &Value, key: &str) -> f64 {
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{key} is not in {of}"));
    match of[key].as_array() {
        Some(axes) => axes.iter().map(number).fold(0.0, f64::hypot),
        None => number(&of[key]),
    }
}

/// The README's section, and the cells of its table: each letter's time, s, and what is said of it.
fn section(readme: &str) -> (&str, Vec<(String, f64, String)>) {
    let section = readme.split("\n## Four letters\n").nth(1).unwrap().split("\n## ").next().unwrap();
    let rows: Vec<Vec<&str>> = section
        .lines()
        .filter(|line| line.starts_with('|') && !line.starts_with("|-"))
        .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
        .collect();
    let [heads, texts] = &rows[..] else { panic!("{rows:?}") };
    let cell = |(head, text): (&&str, &&str)| {
        let (letter, time) = head.split_once(", ").unwrap();
        (letter.to_owned(), time.trim_end_matches(" s").parse().unwrap(), (*text).to_owned())
    };
    (section, heads.iter().zip(texts).map(cell).collect())
}

/// The numbers in `text`: where each is, what it is, and how many decimals it has.
fn numbers(text: &str) -> Vec<(Range<usize>, f64, usize)> {
    let number = |word: &str| {
        let word = word.trim_matches([',', ':', '.']);
        let from = word.as_ptr() as usize - text.as_ptr() as usize;
        let decimals = word.split_once('.').map_or(0, |(_, decimals)| decimals.len());
        Some((from..from + word.len(), word.parse().ok()?, decimals))
    };
    text.split_whitespace().filter_map(number).collect()
}

/// Of the figures in `readme`, those that `lines` do not have.
fn wrong(readme: &str, lines: &[Value]) -> Vec<String> {
    let mut wrong = Vec::new();
    let (_, cells) = section(readme);
    assert_eq!(cells.len(), FIGURES.len(), "{cells:?}");
    for ((letter, t_s, text), (of_letter, field, keys)) in cells.iter().zip(FIGURES) {
        assert_eq!(letter, of_letter);
        let line = line(lines, *t_s);
        let of = field.map_or_else(|| touch(line), |field| percept(line, field, letter));
        let shown = numbers(text);
        assert_eq!(shown.len(), keys.len(), "{text}");
        for ((_, shown, decimals), (key, factor)) in shown.into_iter().zip(keys) {
            let is = factor * size(of, key);
            if format!("{is:.decimals$}") != format!("{shown:.decimals$}") {
                wrong.push(format!("{text}: {key} is {is}"));
            }
        }
    }
    wrong
}

#[test]
fn the_figures_of_the_four_letters_are_what_the_command_writes() {
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    let [command] = &commands(section(&readme).0)[..] else { panic!("one command") };
    let folder = workplace();
    let output = shell(command, folder.path());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let written = std::fs::read_to_string(folder.path().join("meeting.ndjson")).unwrap();
    let lines: Vec<Value> = written.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(wrong(&readme, &lines), Vec::<String>::new());
    // It is one touch: of one time, which began after the other hand was near; on the palm, and pulled to the wrist, along its link's z.
    let cells = section(&readme).1;
    let [near_s, touched_s @ ..] = &cells.iter().map(|(_, t_s, _)| *t_s).collect::<Vec<_>>()[..] else { panic!() };
    let told = touch(line(&lines, touched_s[0]));
    assert!(touched_s.iter().all(|t_s| *t_s == touched_s[0]) && near_s + size(told, "age") < touched_s[0]);
    assert!(told["fields"]["hand/palm"].is_number() && told["link"] == "hand", "{told}");
    let along = told["shear"][2].as_f64().unwrap();
    assert!(-along > 0.99 * size(told, "shear"), "{told}");
    // Each figure is compared: with another last digit it is wrong.
    let mut changed = 0;
    for (.., text) in cells {
        for (place, number, decimals) in numbers(&text) {
            let other = number + 0.1_f64.powi(decimals as i32);
            let mut told = text.clone();
            told.replace_range(place, &format!("{other:.decimals$}"));
            assert_eq!(wrong(&readme.replace(&text, &told), &lines).len(), 1, "{told}");
            changed += 1;
        }
    }
    assert_eq!(changed, 12);
}
