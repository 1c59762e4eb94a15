//! The definition of a message, as a bag's schema `ros2msg` has it: the fields of its type and of all types within it.

use std::collections::HashMap;

use crate::error::{Result, failed};

/// The deepest that messages may lie within each other, against definitions that contain themselves.
const MAX_DEPTH: usize = 16;

/// What a field holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Base {
    Bool,
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
    Text,
    WideText,
    /// A message, by its number in [`Definition`].
    Message(usize),
}

impl Base {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "bool" => Self::Bool,
            "uint8" | "byte" | "char" | "octet" => Self::U8,
            "int8" => Self::I8,
            "uint16" => Self::U16,
            "int16" => Self::I16,
            "uint32" => Self::U32,
            "int32" => Self::I32,
            "uint64" => Self::U64,
            "int64" => Self::I64,
            "float32" => Self::F32,
            "float64" => Self::F64,
            "string" => Self::Text,
            "wstring" => Self::WideText,
            _ => return None,
        })
    }

    /// The bytes of a number; `None` of what is none.
    pub(super) fn size(self) -> Option<usize> {
        match self {
            Self::Bool | Self::U8 | Self::I8 => Some(1),
            Self::U16 | Self::I16 => Some(2),
            Self::U32 | Self::I32 | Self::F32 => Some(4),
            Self::U64 | Self::I64 | Self::F64 => Some(8),
            Self::Text | Self::WideText | Self::Message(_) => None,
        }
    }
}

/// How many of it there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Many {
    One,
    Array(usize),
    Sequence,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) base: Base,
    pub(super) many: Many,
}

/// A type of messages.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Type {
    /// Without `msg`, such as `std_msgs/Header`.
    pub(super) name: String,
    pub(super) fields: Vec<Field>,
}

/// The types that a message is made of; its own is the first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Definition(Vec<Type>);

/// A type's name without `msg` in it.
fn short(name: &str) -> String {
    name.replacen("/msg/", "/", 1)
}

impl Definition {
    /// Parses `text`, the definition of `kind` and of what it is made of.
    ///
    /// # Errors
    /// A line is not a field, or a type is not defined.
    pub(super) fn parse(kind: &str, text: &str) -> Result<Self> {
        let kind = short(kind);
        let mut bodies: HashMap<String, Vec<&str>> = HashMap::new();
        let mut own = kind.clone();
        bodies.insert(own.clone(), Vec::new());
        for line in text.lines() {
            let line = line.trim();
            if let Some(name) = line.strip_prefix("MSG:") {
                own = short(name.trim());
                bodies.entry(own.clone()).or_default().clear();
            } else if line.starts_with("IDL:") || line.starts_with("module ") {
                return Err(failed!(
                    "the definition of {kind} is IDL; give a .msg in the map: definition = \"NAME.msg\""
                ));
            } else if !(line.is_empty() || line.starts_with('#') || line.starts_with("====")) {
                bodies.entry(own.clone()).or_default().push(line);
            }
        }
        // Of a bag that has no definitions.
        if bodies.get(&kind).is_some_and(Vec::is_empty) && usual(&kind).is_some() {
            bodies.remove(&kind);
        }
        let mut definition = Self(Vec::new());
        definition.add(&kind, &bodies, 0)?;
        Ok(definition)
    }

    /// Adds the type `name`, unless it is there; gives its number.
    fn add(&mut self, name: &str, bodies: &HashMap<String, Vec<&str>>, depth: usize) -> Result<usize> {
        if let Some(known) = self.0.iter().position(|one| one.name == name) {
            return Ok(known);
        }
        if depth > MAX_DEPTH {
            return Err(failed!("{name} lies within over {MAX_DEPTH} other messages"));
        }
        let number = self.0.len();
        self.0.push(Type { name: name.to_owned(), fields: Vec::new() });
        let lines = match (bodies.get(name), usual(name)) {
            (Some(lines), _) => lines.clone(),
            (None, Some(lines)) => lines.lines().collect(),
            (None, None) => {
                return Err(failed!("{name} is not defined; add it to the definition, under a line MSG: {name}"));
            }
        };
        let mut fields = Vec::new();
        for line in lines {
            fields.extend(self.field(line, name, bodies, depth)?);
        }
        self.0[number].fields = fields;
        Ok(number)
    }

    /// The field that `line` of the type `within` defines; `None` of a constant.
    fn field(
        &mut self,
        line: &str,
        within: &str,
        bodies: &HashMap<String, Vec<&str>>,
        depth: usize,
    ) -> Result<Option<Field>> {
        let bad = || {
            failed!(
                "the definition of {within} has a line that is not a field: `{}`",
                line.chars().take(60).collect::<String>()
            )
        };
        let line = line.split('#').next().unwrap_or_default().trim();
        let (kind, rest) = line.split_once(char::is_whitespace).ok_or_else(bad)?;
        let name_end = rest.trim_start().find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
        let (name, after) = rest.trim_start().split_at(name_end.unwrap_or(rest.trim_start().len()));
        if name.is_empty() {
            return Err(bad());
        }
        if after.trim_start().starts_with('=') {
            return Ok(None);
        }
        let (base, many) = match kind.split_once('[') {
            None => (kind, Many::One),
            Some((base, many)) => {
                let many = many.strip_suffix(']').ok_or_else(bad)?;
                let many = match many.strip_prefix("<=") {
                    Some(_) => Many::Sequence,
                    None if many.is_empty() => Many::Sequence,
                    None => Many::Array(many.parse().map_err(|_| bad())?),
                };
                (base, many)
            }
        };
        // A text may have a bound: `string<=10`.
        let base = base.split("<=").next().unwrap_or(base);
        let base = match Base::named(base) {
            Some(base) => base,
            None => {
                let package = within.split('/').next().unwrap_or_default();
                let whole = match base {
                    "time" | "duration" => "builtin_interfaces/Time".to_owned(),
                    "Header" => "std_msgs/Header".to_owned(),
                    _ if base.contains('/') => short(base),
                    _ => format!("{package}/{base}"),
                };
                Base::Message(self.add(&whole, bodies, depth + 1)?)
            }
        };
        Ok(Some(Field { name: name.to_owned(), base, many }))
    }

    /// The type of number `number`; the message's own is 0.
    pub(super) fn of(&self, number: usize) -> &Type {
        &self.0[number]
    }

    /// How many types there are.
    pub(super) fn types(&self) -> usize {
        self.0.len()
    }

    /// Whether the type of number `number` is a time: seconds and nanoseconds.
    pub(super) fn is_time(&self, number: usize) -> bool {
        let own = self.of(number);
        let is = |at: usize, names: [&str; 2], bases: [Base; 2]| {
            own.fields.get(at).is_some_and(|field| {
                names.contains(&field.name.as_str()) && bases.contains(&field.base) && field.many == Many::One
            })
        };
        own.fields.len() == 2
            && is(0, ["sec", "secs"], [Base::I32, Base::U32])
            && is(1, ["nanosec", "nsecs"], [Base::U32, Base::I32])
    }

    /// Whether the type of number `number` is an array with a layout, as `std_msgs` has them.
    pub(super) fn is_laid_out(&self, number: usize) -> bool {
        let shape = |number: usize| -> Vec<(&str, Base, Many)> {
            self.of(number).fields.iter().map(|field| (field.name.as_str(), field.base, field.many)).collect()
        };
        let [("layout", Base::Message(layout), Many::One), ("data", base, Many::Sequence)] = shape(number)[..] else {
            return false;
        };
        let [("dim", Base::Message(dimension), Many::Sequence), ("data_offset", Base::U32, Many::One)] =
            shape(layout)[..]
        else {
            return false;
        };
        let expected =
            [("label", Base::Text, Many::One), ("size", Base::U32, Many::One), ("stride", Base::U32, Many::One)];
        base.size().is_some() && shape(dimension) == expected
    }
}

/// Definitions that nobody writes down: those of every ROS.
fn usual(name: &str) -> Option<&'static str> {
    Some(match name {
        "builtin_interfaces/Time" => "int32 sec\nuint32 nanosec",
        "builtin_interfaces/Duration" => "int32 sec\nuint32 nanosec",
        "std_msgs/Header" => "builtin_interfaces/Time stamp\nstring frame_id",
        "std_msgs/MultiArrayDimension" => "string label\nuint32 size\nuint32 stride",
        "std_msgs/MultiArrayLayout" => "MultiArrayDimension[] dim\nuint32 data_offset",
        "std_msgs/Float32MultiArray" => "MultiArrayLayout layout\nfloat32[] data",
        "std_msgs/Float64MultiArray" => "MultiArrayLayout layout\nfloat64[] data",
        "std_msgs/Int8MultiArray" => "MultiArrayLayout layout\nint8[] data",
        "std_msgs/Int16MultiArray" => "MultiArrayLayout layout\nint16[] data",
        "std_msgs/Int32MultiArray" => "MultiArrayLayout layout\nint32[] data",
        "std_msgs/Int64MultiArray" => "MultiArrayLayout layout\nint64[] data",
        "std_msgs/UInt8MultiArray" | "std_msgs/ByteMultiArray" => "MultiArrayLayout layout\nuint8[] data",
        "std_msgs/UInt16MultiArray" => "MultiArrayLayout layout\nuint16[] data",
        "std_msgs/UInt32MultiArray" => "MultiArrayLayout layout\nuint32[] data",
        "std_msgs/UInt64MultiArray" => "MultiArrayLayout layout\nuint64[] data",
        "sensor_msgs/ChannelFloat32" => "string name\nfloat32[] values",
        _ => return None,
    })
}

/// Whether the type `kind` is known without a definition.
pub(in crate::robot) fn is_usual(kind: &str) -> bool {
    usual(&short(kind)).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_definition_is_read_with_all_that_it_is_made_of() {
        let text = "# a hand\nuint8 MAX=3\nstring NAME = 'a # b'\nHeader header\nPad[] pads # each\nint16[2] temperature\n\
            string<=10 name \"none\"\nfloat64[<=4] more\nuint8 mode 7\n\
            ================================================================================\n\
            MSG: maker/Pad\nfloat32[12] pressure\nint64 count\n\
            ================================================================================\n\
            MSG: std_msgs/Header\nbuiltin_interfaces/msg/Time stamp\nstring frame_id\n";
        let definition = Definition::parse("maker/msg/Hand", text).unwrap();
        let own = definition.of(0);
        let names: Vec<&str> = own.fields.iter().map(|field| field.name.as_str()).collect();
        assert_eq!(
            (own.name.as_str(), names),
            ("maker/Hand", vec!["header", "pads", "temperature", "name", "more", "mode"])
        );
        assert_eq!((own.fields[2].base, own.fields[2].many), (Base::I16, Many::Array(2)));
        assert_eq!((own.fields[4].base, own.fields[4].many), (Base::F64, Many::Sequence));
        let Base::Message(pad) = own.fields[1].base else { panic!("{own:?}") };
        assert_eq!(definition.of(pad).fields[0].many, Many::Array(12));
        let Base::Message(header) = own.fields[0].base else { panic!("{own:?}") };
        let Base::Message(stamp) = definition.of(header).fields[0].base else { panic!("{definition:?}") };
        assert!(definition.is_time(stamp) && !definition.is_time(header));
        let array = Definition::parse("std_msgs/msg/Int16MultiArray", "").unwrap();
        assert!(array.is_laid_out(0) && !array.is_laid_out(1));
    }

    #[test]
    fn what_is_not_a_definition_is_refused_in_a_line() {
        for (text, says) in [
            ("float32", "a line that is not a field: `float32`"),
            ("float32[x] a", "not a field"),
            ("Other other", "a/Other is not defined"),
            ("module a {", "is IDL"),
        ] {
            let why = Definition::parse("a/msg/B", text).unwrap_err().to_string();
            assert!(why.contains(says) && why.lines().count() == 1, "{why}");
        }
        // A message within itself has no end, which reading finds.
        assert!(Definition::parse("a/msg/B", "B b").is_ok());
    }
}
