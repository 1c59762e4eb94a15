//! Writes a frame's percepts as one line of JSON. Absent quantities are omitted.

use super::FieldNames;
use super::json::{key, print};
use super::touch_line::{SkinNames, TouchWriter};
use crate::percept::{COLUMNS, Flags, Percept, Percepts, Precision, SelfContact, Store, TouchFrame};

/// Writes lines for fields with given names.
pub(super) struct LineWriter {
    heads: Vec<Head>,
    flags: Vec<(Flags, String)>,
    all_fields: bool,
    /// Where percepts hold touches of the whole body.
    touches: Option<TouchWriter>,
}

/// The start of a field's object, up to the value of `contact`.
struct Head {
    in_anchor: String,
    in_world: String,
    /// As JSON.
    field: String,
}

impl Head {
    fn new(names: &FieldNames) -> Self {
        let text = |text: &str| serde_json::Value::from(text).to_string();
        let named = [("letter", &names.letter), ("signal", &names.signal)].into_iter();
        let named = named.filter_map(|(key, value)| Some(format!(",\"{key}\":{}", text(value.as_ref()?))));
        let letters: String = named.collect();
        let begin =
            |link: &str| format!("{{\"field\":{},\"link\":{}{letters},\"contact\":", text(&names.field), text(link));
        Self { in_anchor: begin(&names.link), in_world: begin(&names.world), field: text(&names.field) }
    }
}

impl LineWriter {
    /// For fields called `names`; fields without contact are listed only with `all_fields`.
    pub(super) fn new(names: &[FieldNames], all_fields: bool) -> Self {
        Self {
            heads: names.iter().map(Head::new).collect(),
            flags: Flags::all().iter_names().map(|(name, flag)| (flag, name.to_lowercase())).collect(),
            all_fields,
            touches: None,
        }
    }

    /// The same, with touches of the whole body where they are looked for: those on `skin`.
    pub(super) fn with_skin(mut self, skin: Option<&SkinNames>) -> Self {
        self.touches = skin.map(TouchWriter::new);
        self
    }

    pub(super) fn fields(&self) -> usize {
        self.heads.len()
    }

    /// Appends the frame `frame` of the batch to `line`.
    pub(super) fn write(&self, percepts: &Percepts, frame: usize, line: &mut Vec<u8>) {
        line.push(b'{');
        self.write_keys(percepts, frame, line);
    }

    /// The same without the `{`, for a line that begins with other keys.
    pub(super) fn write_keys(&self, percepts: &Percepts, frame: usize, line: &mut Vec<u8>) {
        let Self { heads, all_fields, .. } = self;
        line.extend_from_slice(b"\"t\":");
        print(line, &percepts.t_s(frame));
        line.extend_from_slice(b",\"frame\":");
        print(line, &percepts.frame_number(frame));
        let on_skin = self.touches.as_ref().zip(percepts.touches(frame));
        if let Some((touches, found)) = on_skin {
            touches.write(found, |field| &heads[field as usize].field, line);
        }
        line.extend_from_slice(b",\"fields\":[");
        let mut first = true;
        let listed = (0..percepts.fields()).filter(|&field| *all_fields || percepts.in_contact(frame, field));
        for percept in listed.map(|field| percepts.get(frame, field)) {
            if !std::mem::take(&mut first) {
                line.push(b',');
            }
            let head = &heads[percept.field];
            let head = if percept.in_world { &head.in_world } else { &head.in_anchor };
            line.extend_from_slice(head.as_bytes());
            print(line, &percept.contact);
            print_quantities(line, &percept, percepts.precision());
            if let Some((_, found)) = on_skin {
                write_parts(found, percept.field, line);
            }
            self.write_flags(percept.flags, line);
            line.push(b'}');
        }
        line.push(b']');
        if let Some((touches, self_contacts)) = self.touches.as_ref().zip(percepts.self_contacts(frame)) {
            write_self_contacts(touches, self_contacts, line);
        }
        line.push(b'}');
    }

    fn write_flags(&self, own: Flags, line: &mut Vec<u8>) {
        key(line, "flags");
        line.push(b'[');
        for (index, (_, name)) in self.flags.iter().filter(|(flag, _)| own.contains(*flag)).enumerate() {
            line.extend_from_slice(if index == 0 { b"\"" } else { b",\"" });
            line.extend_from_slice(name.as_bytes());
            line.push(b'"');
        }
        line.push(b']');
    }
}

fn write_self_contacts(touches: &TouchWriter, self_contacts: &[SelfContact], line: &mut Vec<u8>) {
    key(line, "self_contacts");
    line.push(b'[');
    for (index, contact) in self_contacts.iter().enumerate() {
        line.extend_from_slice(if index == 0 { b"{\"id\":" } else { b",{\"id\":" });
        print(line, &contact.id);
        let [a, b] = contact.sides.map(|side| touches.link(side.link));
        key(line, "links");
        line.extend_from_slice(format!("[{a},{b}]").as_bytes());
        key(line, "touches");
        print(line, &contact.sides.map(|side| side.touch));
        key(line, "totals");
        print(line, &contact.sides.map(|side| side.total));
        key(line, "position");
        print(line, &contact.position);
        key(line, "distance");
        print(line, &contact.distance);
        key(line, "angle");
        print(line, &contact.angle);
        line.push(b'}');
    }
    line.push(b']');
}

/// The touches that a field holds parts of, each with the field's share of its total.
fn write_parts(found: &TouchFrame, field: usize, line: &mut Vec<u8>) {
    key(line, "touches");
    line.push(b'{');
    let mut first = true;
    for touch in &found.touches {
        let Some(part) = found.fields(touch).iter().find(|part| part.field as usize == field) else { continue };
        line.extend_from_slice(if std::mem::take(&mut first) { b"\"" } else { b",\"" });
        print(line, &touch.id);
        line.extend_from_slice(b"\":");
        print(line, &(part.total / touch.total));
    }
    line.push(b'}');
}

fn print_quantities(line: &mut Vec<u8>, percept: &Percept, precision: Precision) {
    let scalar = |line: &mut Vec<u8>, value: f64| match precision {
        Precision::F32 => print(line, &(value as f32)),
        Precision::F64 => print(line, &value),
    };
    for column in COLUMNS {
        let Some(components) = percept.value(column) else { continue };
        key(line, column.name);
        match column.store {
            Store::Active => print(line, &(components[0] as u32)),
            // In double precision whatever the backend.
            Store::Host(_) if column.is_whole() => print(line, &(components[0] as u32)),
            Store::Host(_) if column.components == 1 => print(line, &components[0]),
            Store::Host(_) => print(line, &&components[..column.components]),
            Store::Backend([_]) => scalar(line, components[0]),
            Store::Backend(_) => {
                line.push(b'[');
                for (index, &component) in components[..column.components].iter().enumerate() {
                    if index > 0 {
                        line.push(b',');
                    }
                    scalar(line, component);
                }
                line.push(b']');
            }
        }
    }
}
