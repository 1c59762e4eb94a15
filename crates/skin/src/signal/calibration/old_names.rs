//! Calibrations that recordings carry from before names changed.

use toml::{Table, Value};

use super::Calibration;
use crate::renamed::new_name;

/// Tables whose names changed, and keys of `[all]` and `[taxel.N]`, as they are called now.
const TABLES: [&str; 2] = ["layer", "drift"];
const KEYS: [&str; 1] = ["wiper"];

impl Calibration {
    /// `text`, the calibration that a recording carries, with the names of now, and what was called otherwise, as people read it:
    /// `[upkeep]` is `[drift]` now. Nobody can change a recording, so it is not refused as a file is.
    #[must_use]
    pub fn with_names_of_now(text: String) -> (String, Vec<String>) {
        // What is not TOML is reported by whoever reads it.
        let Ok(mut file) = toml::from_str::<Table>(&text) else { return (text, Vec::new()) };
        let mut renamings = Vec::new();
        rename(&mut file, &TABLES, |was, new| renamings.push(format!("`[{was}]` is `[{new}]` now")));
        let mut of_taxels = |keys: &mut Table| {
            rename(keys, &KEYS, |was, new| {
                let what = format!("`{was}` is `{new}` now");
                if !renamings.contains(&what) {
                    renamings.push(what);
                }
            });
        };
        file.get_mut("all").and_then(Value::as_table_mut).into_iter().for_each(&mut of_taxels);
        let taxels = file.get_mut("taxel").and_then(Value::as_table_mut);
        taxels.into_iter().flatten().filter_map(|(_, keys)| keys.as_table_mut()).for_each(of_taxels);
        match toml::to_string(&file) {
            Ok(text) if !renamings.is_empty() => (text, renamings),
            _ => (text, Vec::new()),
        }
    }
}

/// Gives what of `table` has an old name the one among `now` that it has since, unless that is there too.
fn rename(table: &mut Table, now: &[&str], mut tell: impl FnMut(&str, &str)) {
    let old: Vec<(String, String)> = table
        .keys()
        .filter_map(|was| Some((was.clone(), new_name(was, now.iter().copied())?)))
        .filter(|(_, new)| !table.contains_key(new))
        .collect();
    for (was, new) in old {
        if let Some(value) = table.remove(&was) {
            tell(&was, &new);
            table.insert(new, value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::Response;

    #[test]
    fn old_names_of_a_recording_are_read_and_reported() {
        let old =
            "[all]\nsensor = \"fsr\"\ntap = 12\n[taxel.3]\ntap = 7\n[skin]\nsigma_m = 0.002\n[upkeep]\ndead_s = 2\n";
        assert!(
            Calibration::parse(old, &[3, 4]).unwrap_err().to_string().ends_with("is `wiper` now"),
            "a file is refused"
        );
        let (text, renamings) = Calibration::with_names_of_now(old.to_owned());
        assert_eq!(
            renamings,
            ["`[skin]` is `[layer]` now", "`[upkeep]` is `[drift]` now", "`tap` is `wiper` now"],
            "each once, tables first"
        );
        let read = Calibration::parse(&text, &[3, 4]).unwrap();
        assert_eq!((read.layer.unwrap().sigma_m, read.drift.dead_s), (0.002, Some(2.0)));
        let wiper = |taxel: usize| match read.taxels[taxel].response {
            Response::Fsr(fsr) => fsr.wiper,
            _ => panic!("{text}"),
        };
        assert_eq!([wiper(0), wiper(1)], [7, 12]);
        // What has the names of now, or is not a calibration, stays as it is to the byte.
        for same in ["# mine\n[layer]\nsigma_m = 0.002 # m\n", "[all"] {
            assert_eq!(Calibration::with_names_of_now(same.to_owned()), (same.to_owned(), Vec::new()));
        }
    }
}
