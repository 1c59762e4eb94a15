//! Writes the selected combination into a scene file in place of the target; keeps everything else, comments too.

use toml_edit::{DocumentMut, Item, Table, value};

use super::{Combination, Target, Words};
use crate::backend::BackendKind;
use crate::error::{Error, Result};
use crate::limits::{self, MAX_TOML_BYTES};
use crate::output::OutputPath;
use crate::scene::{Cadence, Charts, Coverage, Knobs, OrientationBy};

/// Writes `combination`, which was selected for `target`, into the file `scene`.
///
/// # Errors
/// The file cannot be read or written, or is not TOML.
pub fn write_pick(scene: OutputPath, combination: &Combination, target: &Target) -> Result<()> {
    let path = scene.name();
    let text = limits::read_to_string(path, MAX_TOML_BYTES).map_err(|e| Error::io(path, &e))?;
    let text = with(&text, combination, target).map_err(|e| e.at(path.display()))?;
    scene.write(text.as_bytes())
}

fn with(text: &str, combination: &Combination, target: &Target) -> Result<String> {
    let mut document: DocumentMut = text.parse().map_err(|e| Error::failed(format!("{e}")))?;
    let Words { backend, arithmetic, .. } = combination.words();
    let Knobs { charts, orientation_by, coverage, cadence, .. } = combination.knobs;
    let table = document.entry("accuracy").or_insert_with(|| Item::Table(Table::new()));
    let Some(table) = table.as_table_like_mut() else { return Err(Error::failed("`accuracy` is not a table")) };
    for key in ["centroid", "orientation", "budget"] {
        table.remove(key);
    }
    let mut knob = |key: &str, word: &str, usual: bool| {
        if usual {
            table.remove(key);
        } else {
            table.insert(key, value(word));
        }
    };
    knob("arithmetic", &arithmetic, combination.backend == BackendKind::Reference);
    knob("charts", charts.word(), charts == Charts::AsAuthored);
    knob("orientation_by", orientation_by.word(), orientation_by == OrientationBy::AsAsked);
    knob("coverage", coverage.word(), coverage == Coverage::Auto);
    knob("cadence", cadence.word(), cadence == Cadence::EveryFrame);
    let first = table.iter().next().map(|(key, _)| key.to_owned());
    if let Some(mut key) = first.and_then(|first| table.key_mut(&first)) {
        key.leaf_decor_mut().set_prefix(format!("# Picked by `somatic tradeoff` for {}.\n", target.words()));
    }
    let is_empty = table.is_empty();
    if is_empty {
        document.remove("accuracy");
    }
    document["backend"] = value(backend);
    Ok(document.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Arithmetic;

    #[test]
    fn a_pick_takes_the_place_of_the_wish_and_comments_stay() {
        let text = "# Mine.\nbody = \"hand\" # the left\noutputs = [\n  \"centroid\", # where\n]\n\n[accuracy]\ncentroid = \
                    \"0.5 mm\"\nbudget = \"1 ms\"\n";
        let knobs = Knobs::default().arithmetic(Arithmetic::OnePass).coverage(Coverage::Touched);
        let target = Target::within("0.5 mm").unwrap();
        let written = with(text, &Combination { backend: BackendKind::Cpu, knobs }, &target).unwrap();
        let right = "# Mine.\nbody = \"hand\" # the left\noutputs = [\n  \"centroid\", # where\n]\nbackend = \"cpu\"\n\n\
                     [accuracy]\n# Picked by `somatic tradeoff` for 0.5 mm.\narithmetic = \"one-pass\"\ncoverage = \
                     \"touched\"\n";
        assert_eq!(written, right);
        // Again, otherwise: nothing piles up.
        let again = with(&written, &Combination { backend: BackendKind::Reference, knobs: Knobs::default() }, &target);
        assert_eq!(again.unwrap(), right.split("\n[accuracy]").next().unwrap().replace("\"cpu\"", "\"reference\""));
        assert!(with("accuracy = 3", &Combination { backend: BackendKind::Cpu, knobs }, &target).is_err());
    }
}
