//! Reads PLY: text, and binary of either order of bytes.

use glam::DVec3;

use super::triangles::Triangles;
use crate::error::{Error, Result, failed};

/// The type of a property's numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Number {
    Signed(usize),
    Unsigned(usize),
    Float(usize),
}

#[derive(Debug)]
struct Property {
    name: String,
    number: Number,
    /// For a list, the type of its length.
    length: Option<Number>,
}

#[derive(Debug)]
struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Format {
    Text,
    Little,
    Big,
}

/// The triangles of a PLY file; faces of more corners are divided into triangles.
pub(super) fn read(bytes: &[u8]) -> Result<Triangles> {
    let (format, elements, body) = header(bytes)?;
    let mut numbers = Numbers { rest: body, format };
    let mut mesh = Triangles::default();
    for element in &elements {
        let place = |name: &str| element.properties.iter().position(|property| property.name == name);
        let is_vertex = element.name == "vertex";
        let xyz = match (place("x"), place("y"), place("z")) {
            (Some(x), Some(y), Some(z)) => [x, y, z],
            _ if is_vertex => return Err(Error::failed("its vertices have no x, y and z")),
            _ => [0; 3],
        };
        let corners = place("vertex_indices").or(place("vertex_index")).filter(|_| element.name == "face");
        for row in 0..element.count {
            let mut position = DVec3::ZERO;
            for (index, property) in element.properties.iter().enumerate() {
                let damaged =
                    || failed!("it ends in {} {row} of {}; copy or export it again", element.name, element.count);
                let count = match property.length {
                    None => 1,
                    Some(length) => numbers.next(length).ok_or_else(damaged)? as u64,
                };
                let mut face: Vec<u32> = Vec::new();
                for _ in 0..count {
                    let number = numbers.next(property.number).ok_or_else(damaged)?;
                    if is_vertex && let Some(axis) = xyz.iter().position(|&own| own == index) {
                        position[axis] = number;
                    }
                    if Some(index) == corners {
                        face.push(number as u32);
                    }
                }
                // A fan: right for convex faces, as nearly all are.
                mesh.triangles.extend((2..face.len()).map(|corner| [face[0], face[corner - 1], face[corner]]));
            }
            if is_vertex {
                mesh.positions.push(position);
            }
        }
    }
    Ok(mesh)
}

fn header(bytes: &[u8]) -> Result<(Format, Vec<Element>, &[u8])> {
    let mut rest = bytes;
    let mut line_number = 0;
    let mut next = || -> Result<String> {
        line_number += 1;
        let end = rest.iter().position(|&b| b == b'\n');
        let end = end.ok_or_else(|| Error::failed("its header has no `end_header`; export it again"))?;
        let (line, after) = rest.split_at(end);
        rest = &after[1..];
        Ok(String::from_utf8_lossy(line).trim().to_owned())
    };
    if next()? != "ply" {
        return Err(Error::failed("not a PLY: it does not begin with `ply`"));
    }
    let (mut format, mut elements) = (None, Vec::<Element>::new());
    loop {
        let line = next()?;
        let words: Vec<&str> = line.split_whitespace().collect();
        let wrong = || failed!("`{line}` is not understood in its header; export it again");
        match words[..] {
            ["end_header"] => break,
            ["format", "ascii", _] => format = Some(Format::Text),
            ["format", "binary_little_endian", _] => format = Some(Format::Little),
            ["format", "binary_big_endian", _] => format = Some(Format::Big),
            ["element", name, count] => {
                let count = count.parse().map_err(|_| wrong())?;
                elements.push(Element { name: name.to_owned(), count, properties: Vec::new() });
            }
            ["property", "list", length, number, name] => {
                let property = Property {
                    name: name.to_owned(),
                    number: type_of(number).ok_or_else(wrong)?,
                    length: Some(type_of(length).ok_or_else(wrong)?),
                };
                elements.last_mut().ok_or_else(wrong)?.properties.push(property);
            }
            ["property", number, name] => {
                let property =
                    Property { name: name.to_owned(), number: type_of(number).ok_or_else(wrong)?, length: None };
                elements.last_mut().ok_or_else(wrong)?.properties.push(property);
            }
            ["comment" | "obj_info", ..] | [] => {}
            _ => return Err(wrong()),
        }
    }
    let format = format.ok_or_else(|| Error::failed("its header has no `format`; export it again"))?;
    Ok((format, elements, rest))
}

fn type_of(word: &str) -> Option<Number> {
    Some(match word {
        "char" | "int8" => Number::Signed(1),
        "short" | "int16" => Number::Signed(2),
        "int" | "int32" => Number::Signed(4),
        "uchar" | "uint8" => Number::Unsigned(1),
        "ushort" | "uint16" => Number::Unsigned(2),
        "uint" | "uint32" => Number::Unsigned(4),
        "float" | "float32" => Number::Float(4),
        "double" | "float64" => Number::Float(8),
        _ => return None,
    })
}

struct Numbers<'a> {
    rest: &'a [u8],
    format: Format,
}

impl Numbers<'_> {
    fn next(&mut self, number: Number) -> Option<f64> {
        if self.format == Format::Text {
            let start = self.rest.iter().position(|b| !b.is_ascii_whitespace())?;
            let word = &self.rest[start..];
            let end = word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len());
            self.rest = &word[end..];
            return std::str::from_utf8(&word[..end]).ok()?.parse().ok();
        }
        let (Number::Signed(size) | Number::Unsigned(size) | Number::Float(size)) = number;
        let (own, rest) = self.rest.split_at_checked(size)?;
        self.rest = rest;
        let mut little = [0; 8];
        little[..size].copy_from_slice(own);
        if self.format == Format::Big {
            little[..size].reverse();
        }
        let whole = u64::from_le_bytes(little);
        Some(match number {
            Number::Unsigned(_) => whole as f64,
            Number::Signed(1) => f64::from(whole as i8),
            Number::Signed(2) => f64::from(whole as i16),
            Number::Signed(_) => f64::from(whole as i32),
            Number::Float(4) => f64::from(f32::from_bits(whole as u32)),
            Number::Float(_) => f64::from_bits(whole),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "element vertex 4\nproperty float x\nproperty double y\nproperty uchar red\nproperty float z\n\
                          element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    const CORNERS: [[f64; 3]; 4] = [[0.0, 0.0, 0.5], [1.0, 0.0, 0.5], [1.0, 1.0, 0.5], [0.0, 1.0, 0.5]];

    fn binary(big: bool) -> Vec<u8> {
        let name = if big { "binary_big_endian" } else { "binary_little_endian" };
        let mut bytes = format!("ply\r\nformat {name} 1.0\ncomment made here\n{HEADER}").into_bytes();
        let mut put = |mut own: Vec<u8>| {
            if big {
                own.reverse();
            }
            bytes.extend(own);
        };
        for [x, y, z] in CORNERS {
            put((x as f32).to_le_bytes().to_vec());
            put(y.to_le_bytes().to_vec());
            put(vec![7]);
            put((z as f32).to_le_bytes().to_vec());
        }
        put(vec![4]);
        (0..4_i32).for_each(|v| put(v.to_le_bytes().to_vec()));
        bytes
    }

    #[test]
    fn all_three_formats_are_one_mesh() {
        let rows: String = CORNERS.iter().map(|[x, y, z]| format!("{x} {y} 7 {z}\n")).collect();
        let text = format!("ply\nformat ascii 1.0\n{HEADER}{rows}4 0 1 2 3\n");
        for bytes in [text.into_bytes(), binary(false), binary(true)] {
            let mesh = read(&bytes).unwrap();
            assert_eq!(mesh.positions, CORNERS.map(DVec3::from_array));
            assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        }
    }

    #[test]
    fn what_is_cut_short_or_no_ply_is_said() {
        let whole = binary(false);
        for end in 0..whole.len() {
            let why = read(&whole[..end]).unwrap_err().to_string();
            assert!(!why.contains('\n') && why.len() > 10, "{why}");
        }
        assert!(read(b"solid\n").unwrap_err().to_string().contains("not a PLY"));
        let huge = b"ply\nformat ascii 1.0\nelement vertex 99999999999999\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n";
        assert!(read(huge).unwrap_err().to_string().contains("ends in vertex 1"));
    }
}
