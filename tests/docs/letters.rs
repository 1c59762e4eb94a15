//! The README's table of four letters: each of its figures is what the command above it writes.

use super::{commands, root, shell, workplace};

/// A figure: a column, and how many of the README's units are one of the column's.
type Figure = (&'static str, f64);

/// By letter: the field that the README speaks of, and what its figures are, in their order.
const FIGURES: [(&str, &str, &[Figure]); 4] = [
    ("proximity", "hand/palm", &[("nearest [m]", 1e3), ("approach_speed [m/s]", 1.0)]),
    ("sustained", "hand/palm", &[("total [N]", 1.0)]),
    ("temperature", "hand/palm", &[("temperature [°C]", 1.0), ("warmest [°C]", 1.0), ("temperature_rate [K/s]", 1.0)]),
    ("shear", "hand/midhand/index", &[("friction", 1.0), ("slip_ratio", 100.0)]),
];

/// A table of percepts: its columns' names, and its rows.
struct Table(Vec<String>, Vec<Vec<String>>);

impl Table {
    fn read(text: &str) -> Self {
        let cells = |line: &str| line.split(',').map(str::to_owned).collect();
        let mut lines = text.lines();
        Self(cells(lines.next().unwrap()), lines.map(cells).collect())
    }

    /// The value of `column` in the row of this field, letter and time.
    fn value(&self, field: &str, letter: &str, t_s: f64, column: &str) -> f64 {
        let place = |name: &str| self.0.iter().position(|own| own == name).unwrap_or_else(|| panic!("no {name}"));
        let [of_t, of_field, of_letter, own] = ["t [s]", "field", "letter", column].map(place);
        let is_it = |row: &&Vec<String>| {
            row[of_field] == field && row[of_letter] == letter && row[of_t].parse::<f64>().unwrap() == t_s
        };
        let row = self.1.iter().find(is_it).unwrap_or_else(|| panic!("no row of {field}, {letter}, {t_s} s"));
        row[own].parse().unwrap_or_else(|_| panic!("{column} of {field} at {t_s} s is `{}`", row[own]))
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

/// The numbers in `text`, with how many decimals each has.
fn numbers(text: &str) -> Vec<(f64, usize)> {
    let number = |word: &str| {
        let word = word.trim_matches([',', ':', '.']);
        Some((word.parse().ok()?, word.split_once('.').map_or(0, |(_, decimals)| decimals.len())))
    };
    text.split_whitespace().filter_map(number).collect()
}

/// Of the figures in `readme`, those that `table` does not have.
fn wrong(readme: &str, table: &Table) -> Vec<String> {
    let mut wrong = Vec::new();
    let (_, cells) = section(readme);
    assert_eq!(cells.len(), FIGURES.len(), "{cells:?}");
    for ((letter, t_s, text), (of_letter, field, columns)) in cells.iter().zip(FIGURES) {
        assert_eq!(letter, of_letter);
        let shown = numbers(text);
        assert_eq!(shown.len(), columns.len(), "{text}");
        for ((shown, decimals), (column, factor)) in shown.into_iter().zip(columns) {
            let is = factor * table.value(field, letter, *t_s, column);
            if format!("{is:.decimals$}") != format!("{shown:.decimals$}") {
                wrong.push(format!("{text}: {column} is {is}"));
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
    let table = Table::read(&std::fs::read_to_string(folder.path().join("meeting.csv")).unwrap());
    assert_eq!(wrong(&readme, &table), Vec::<String>::new());
    // It is dragged along the finger, which lies along its link's z.
    let of_axis = |axis: char| table.value("hand/midhand/index", "shear", 4.8, &format!("shear_vector_{axis} [N]"));
    let [x, y, z] = ['x', 'y', 'z'].map(of_axis);
    assert!(z.abs() > 0.99 * x.hypot(y).hypot(z), "{x} {y} {z}");
    // Each figure is compared: with another last digit it is wrong.
    let mut changed = 0;
    for (.., text) in section(&readme).1 {
        for (number, decimals) in numbers(&text) {
            let other = number + 0.1_f64.powi(decimals as i32);
            let told = text.replace(&format!("{number:.decimals$} "), &format!("{other:.decimals$} "));
            assert_eq!(wrong(&readme.replace(&text, &told), &table).len(), 1, "{told}");
            changed += 1;
        }
    }
    assert_eq!(changed, 8);
}
