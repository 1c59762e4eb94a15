//! A bench's inputs and outputs as arrays, so that anybody can check them with their own program.

use serde_json::{Map, Value, json};

use super::npy;
use somatic::body::Body;
use somatic::error::{Error, Result};
use somatic::field::{Field, FieldSet};
use somatic::internal::output::OutputFolder;
use somatic::internal::shape::Shape;
use somatic::percept::{Flags, Outputs, Percept, Percepts, Precision};
use somatic::signal::Frame;

/// The files that [`write()`] writes for `shape` and `outputs`.
pub fn files(shape: &Shape, outputs: Outputs) -> Vec<String> {
    let fields = |prefix: &str| ["members", "weights", "uv"].map(|name| format!("{prefix}{name}"));
    let mut names = vec!["values".to_owned(), "present".to_owned(), "flags".to_owned()];
    names.extend(fields(""));
    names.extend(Some(fields("wide_")).filter(|_| shape.wide > 0).into_iter().flatten());
    names.extend(outputs.iter().map(name_of));
    names.iter().map(|name| format!("{name}.npy")).chain(["dump.json".to_owned()]).collect()
}

/// Writes what went in and came out of an engine's first call into `folder`, which has [`files`] and is made where there
/// is none: arrays as .npy, and `dump.json`, written last, which names them.
///
/// `values` (frames, sensors); `members`, sensors, and `weights` (fields, members), `uv` (fields, members, 2), m; the same
/// of the wide field, if there is one, as `wide_...`; each output (frames, fields) or (frames, fields, 2 or 3), with the
/// wide field last; `present` and `flags` (frames, fields), whose bits the JSON names. Where an output's bit is not set
/// in `present`, it is absent, and its array has 0 there.
pub fn write(
    mut folder: OutputFolder,
    shape: &Shape,
    body: &Body,
    frames: &[Frame],
    percepts: &Percepts,
    backend: &str,
) -> Result<()> {
    folder.make()?;
    let mut dump = Dump { folder: &mut folder, arrays: Map::new() };
    let fields = FieldSet::new(body)?.fields;
    dump.input(shape, &fields, frames)?;
    dump.output(percepts)?;
    let present_bits: Map<_, _> =
        percepts.outputs().iter().map(|output| (name_of(output), output.bits().into())).collect();
    let flag_bits: Map<_, _> = Flags::all().iter().map(|flag| (flag.names().collect(), flag.bits().into())).collect();
    let index = json!({
        "shape": {
            "sensors": shape.sensors, "fields": shape.fields, "members": shape.members, "wide": shape.wide,
            "local": shape.local, "frames": shape.frames, "seed": shape.seed,
        },
        "backend": backend,
        "arrays": dump.arrays,
        "present_bits": present_bits,
        "flag_bits": flag_bits,
    });
    let text = serde_json::to_string_pretty(&index).map_err(|e| Error::failed(e.to_string()))?;
    folder.take("dump.json").write((text + "\n").as_bytes())
}

/// Whether `outputs` can be written.
pub fn check(outputs: Outputs) -> Result<()> {
    if outputs.contains(Outputs::SELF_CONTACTS) {
        return Err(Error::usage(
            "--dump writes arrays, and self_contacts are not arrays; leave them out of --outputs",
        ));
    }
    Ok(())
}

struct Dump<'a> {
    folder: &'a mut OutputFolder,
    arrays: Map<String, Value>,
}

impl Dump<'_> {
    fn put<N: npy::Number>(
        &mut self,
        name: &str,
        unit: &str,
        shape: &[usize],
        numbers: impl Iterator<Item = N>,
    ) -> Result<()> {
        let file = format!("{name}.npy");
        npy::write(self.folder.take(&file), shape, numbers)?;
        self.arrays.insert(name.to_owned(), json!({ "file": file, "dtype": N::DTYPE, "shape": shape, "unit": unit }));
        Ok(())
    }

    fn input(&mut self, shape: &Shape, fields: &[Field], frames: &[Frame]) -> Result<()> {
        let values = frames.iter().flat_map(|frame| &frame.values).map(|value| f32::from_bits(value.to_bits()));
        self.put("values", "P", &[shape.frames, shape.sensors], values)?;
        let (alike, wide) = fields.split_at(shape.fields);
        self.fields("", &[shape.fields, shape.members], alike)?;
        if !wide.is_empty() {
            self.fields("wide_", &[shape.wide], wide)?;
        }
        Ok(())
    }

    fn fields(&mut self, prefix: &str, shape: &[usize], fields: &[Field]) -> Result<()> {
        let members = || fields.iter().flat_map(|field| &field.members);
        self.put(&format!("{prefix}members"), "sensor", shape, members().map(|member| member.taxel as u32))?;
        self.put(&format!("{prefix}weights"), "1", shape, members().map(|member| member.weight))?;
        let uv = members().flat_map(|member| [member.place.x, member.place.y]);
        self.put(&format!("{prefix}uv"), "m", &[shape, &[2]].concat(), uv)
    }

    fn output(&mut self, percepts: &Percepts) -> Result<()> {
        let cells = [percepts.frames(), percepts.fields()];
        let all = || (0..cells[0]).flat_map(|frame| percepts.frame(frame));
        for column in percepts.outputs().columns() {
            let width = column.components;
            let shape = if width == 1 { cells.to_vec() } else { vec![cells[0], cells[1], width] };
            let numbers = all().flat_map(|percept| percept.value(column).unwrap_or_default().into_iter().take(width));
            if percepts.precision() == Precision::F32 && !column.is_double() {
                self.put(column.name, column.unit.symbol(), &shape, numbers.map(|number| number as f32))?;
            } else {
                self.put(column.name, column.unit.symbol(), &shape, numbers)?;
            }
        }
        let is_present = |percept: &Percept| {
            let there = percepts.outputs().columns().filter(|column| percept.value(column).is_some());
            there.fold(Outputs::empty(), |sum, column| sum | column.output).bits()
        };
        self.put("present", "bits", &cells, all().map(|percept| is_present(&percept)))?;
        self.put("flags", "bits", &cells, all().map(|percept| percept.flags.bits()))
    }
}

fn name_of(output: Outputs) -> String {
    output.names().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use somatic::backend::BackendKind;

    #[test]
    fn every_output_but_touches_and_contacts_is_an_array() {
        let outputs = Outputs::all() - Outputs::SELF_CONTACTS - Outputs::OF_OTHER_LETTERS;
        assert!(check(outputs).is_ok() && check(Outputs::all()).is_err());
        let shape = Shape { sensors: 30, fields: 2, members: 6, wide: 0, local: false, frames: 4, seed: 1 };
        let mut engine = shape.engine(&shape.body(), BackendKind::Reference, outputs).unwrap();
        let percepts = engine.process(&shape.frames()).unwrap();
        let mut percept = percepts.get(3, 0);
        // Random touches jump farther than the filter's window.
        percept.filtered_displacement = percept.displacement;
        percept.filtered_direction = percept.direction;
        percept.filtered_speed = percept.speed;
        // Bodies of this kind have no calibration, and so no noise.
        percept.total_sigma = percept.total;
        percept.centroid_sigma = percept.centroid;
        percept.principal_axis_sigma = percept.principal_axis;
        // And their frames have no poses.
        percept.speed_in_world = percept.speed;
        assert_eq!(outputs.columns().count(), outputs.iter().count());
        // Nor do they have a unit.
        for column in (outputs - Outputs::FORCE).columns() {
            let numbers = percept.value(column).unwrap_or_else(|| panic!("{}", column.name));
            assert_eq!(numbers[column.components..].iter().sum::<f64>(), 0.0, "{} has more", column.name);
        }
    }
}
