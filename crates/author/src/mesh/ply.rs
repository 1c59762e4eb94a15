//! Reads PLY: text, and binary of either order of bytes.

use glam::DVec3;

use super::triangles::{Triangles, whole};
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
    let line = 1 + bytes[..bytes.len() - body.len()].iter().filter(|&&byte| byte == b'\n').count();
    let mut numbers = Numbers { rest: body, format, line };
    let mut mesh = Triangles::default();
    let mut face: Vec<u32> = Vec::new();
    for element in &elements {
        let place = |name: &str| element.properties.iter().position(|property| property.name == name);
        let is_vertex = element.name == "vertex";
        let xyz = match (place("x"), place("y"), place("z")) {
            (Some(x), Some(y), Some(z)) => [x, y, z],
            _ if is_vertex => return Err(Error::failed("its vertices have no x, y and z")),
            _ => [0; 3],
        };
        let corners = place("vertex_indices").or(place("vertex_index")).filter(|_| element.name == "face");
        if element.properties.is_empty() {
            // Of these nothing is stored, however many there are.
            continue;
        }
        for row in 0..element.count {
            let at = |what: String| match format {
                Format::Text => Error::failed(what),
                _ => Error::failed(what).at(format!("{} {row}", element.name)),
            };
            let mut position = DVec3::ZERO;
            for (index, property) in element.properties.iter().enumerate() {
                let damaged =
                    || failed!("it ends in {} {row} of {}; copy or export it again", element.name, element.count);
                let count = match property.length {
                    None => 1,
                    Some(length) => {
                        let number = numbers.next(length, damaged)?;
                        whole(number).ok_or_else(|| {
                            numbers.at(at(format!("a list of {number} `{}`; export it again", property.name)))
                        })?
                    }
                };
                face.clear();
                for _ in 0..count {
                    let number = numbers.next(property.number, damaged)?;
                    if is_vertex && let Some(axis) = xyz.iter().position(|&own| own == index) {
                        position[axis] = number;
                    }
                    if Some(index) == corners {
                        face.push(whole(number).ok_or_else(|| {
                            numbers.at(at(format!("a corner is vertex {number}; give its number, from 0 on")))
                        })?);
                    }
                }
                mesh.fan(&face);
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
    /// Of what was read last, in a text.
    line: usize,
}

impl Numbers<'_> {
    /// `error` at the line of what was read last, in a text.
    fn at(&self, error: Error) -> Error {
        if self.format == Format::Text { error.at(format!("line {}", self.line)) } else { error }
    }

    /// The next number, or the error `damaged` at the end of the file.
    fn next(&mut self, number: Number, damaged: impl Fn() -> Error) -> Result<f64> {
        if self.format == Format::Text {
            let begin = self.rest.iter().position(|b| !b.is_ascii_whitespace()).ok_or_else(&damaged)?;
            self.line += self.rest[..begin].iter().filter(|&&byte| byte == b'\n').count();
            let word = &self.rest[begin..];
            let end = word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len());
            self.rest = &word[end..];
            let word = String::from_utf8_lossy(&word[..end]);
            return word.parse().map_err(|_| self.at(failed!("`{word}` is not a number; export it again")));
        }
        self.binary(number).ok_or_else(damaged)
    }

    fn binary(&mut self, number: Number) -> Option<f64> {
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
    fn what_is_cut_short_or_no_ply_is_reported() {
        let whole = binary(false);
        for end in 0..whole.len() {
            let why = read(&whole[..end]).unwrap_err().to_string();
            assert!(!why.contains('\n') && why.len() > 10, "{why}");
        }
        // Nor does a count of what is stored nowhere take time.
        let ghost = b"ply\nformat ascii 1.0\nelement ghost 1000000000000\nelement vertex 1\nproperty float x\nproperty float y\n\
                      property float z\nend_header\n1 2 3\n";
        assert_eq!(read(ghost).unwrap().positions.len(), 1);
        assert!(read(b"solid\n").unwrap_err().to_string().contains("not a PLY"));
        let huge = b"ply\nformat ascii 1.0\nelement vertex 99999999999999\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n";
        assert!(read(huge).unwrap_err().to_string().contains("ends in vertex 1"));
    }

    #[test]
    fn a_face_names_vertices_by_whole_numbers() {
        let with = |face: &str| {
            let header = HEADER.replace("uchar int", "char float");
            let text = format!("ply\nformat ascii 1.0\n{header}0 0 7 0\n1 0 7 0\n1 1 7 0\n0 1 7 0\n{face}\n");
            read(text.as_bytes()).map(|mesh| mesh.triangles).map_err(|e| e.to_string())
        };
        assert_eq!(with("3 0 1 2"), Ok(vec![[0, 1, 2]]));
        for wrong in ["-1", "2.9", "nan", "inf", "4294967296"] {
            let why = with(&format!("3 0 1 {wrong}")).unwrap_err().to_lowercase();
            assert!(why.starts_with(&format!("line 15: a corner is vertex {wrong}; ")), "{why}");
        }
        assert!(with("-3 0 1 2").unwrap_err().starts_with("line 15: a list of -3 `vertex_indices`"));
        assert!(with("3 0 1 two").unwrap_err().starts_with("line 15: `two` is not a number"));
        let mut bytes = binary(false);
        let end = bytes.len();
        bytes[end - 4..].fill(0xFF);
        assert!(read(&bytes).unwrap_err().to_string().starts_with("face 0: a corner is vertex -1"));
    }
}
