//! Reads OBJ: its vertices in their order, and its faces.

use std::borrow::Cow;

use glam::DVec3;

use super::triangles::Triangles;
use crate::error::{Error, Result, failed};

/// The mesh of an OBJ file. Normals, textures, materials, groups and lines are of no use here.
pub(super) fn read(bytes: &[u8]) -> Result<Triangles> {
    let mut mesh = Triangles::default();
    let mut corners = Vec::new();
    let mut begun: Vec<u8> = Vec::new();
    for (line, number) in bytes.split(|&byte| byte == b'\n').zip(1_u64..) {
        let line = line.trim_ascii();
        // A line that ends in `\` goes on in the next.
        if let Some(part) = line.strip_suffix(b"\\") {
            begun.extend(part);
            begun.push(b' ');
            continue;
        }
        let whole = if begun.is_empty() { Cow::Borrowed(line) } else { Cow::Owned([&begun[..], line].concat()) };
        begun.clear();
        add(&whole, &mut corners, &mut mesh).map_err(|e| e.at(format!("line {number}")))?;
    }
    Ok(mesh)
}

fn add(line: &[u8], corners: &mut Vec<u32>, mesh: &mut Triangles) -> Result<()> {
    let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    match words.next() {
        Some(b"v") => {
            // A fourth number is a weight of curves, and more are a colour.
            let mut number = || words.next().and_then(|word| std::str::from_utf8(word).ok()?.parse::<f64>().ok());
            let (Some(x), Some(y), Some(z)) = (number(), number(), number()) else {
                return Err(Error::failed("a vertex without three numbers; export it again"));
            };
            mesh.positions.push(DVec3::new(x, y, z));
        }
        Some(b"f" | b"fo") => {
            corners.clear();
            for word in words.take_while(|word| !word.starts_with(b"#")) {
                corners.push(corner(word, mesh.positions.len())?);
            }
            if corners.len() < 3 {
                return Err(Error::failed("a face of fewer than three corners; export it again"));
            }
            mesh.fan(corners);
        }
        _ => {}
    }
    Ok(())
}

/// The vertex that `word` means, of `count` so far: from 1 on, or back from the last one; what follows a slash is not a place.
fn corner(word: &[u8], count: usize) -> Result<u32> {
    let own = word.split(|&byte| byte == b'/').next().and_then(|own| std::str::from_utf8(own).ok());
    let index = match own.and_then(|own| own.parse::<i64>().ok()) {
        Some(index @ 1..) => Some(index - 1),
        Some(index @ ..=-1) => (count as i64).checked_add(index).filter(|&index| index >= 0),
        _ => None,
    };
    // A face may name vertices that follow: whether they do is checked at the end.
    let wrong = || failed!("a corner `{}`; give the number of a vertex, from 1 on", String::from_utf8_lossy(word));
    index.and_then(|index| u32::try_from(index).ok()).ok_or_else(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_count_from_one_or_back_from_the_last_vertex() {
        let text = "# a\nmtllib no.mtl\no a\nv 0 0 0\nv 1 0 0 1 0 0\nv  1 1 0\nvn 0 0 1\nusemtl b\ns off\n\
                    f 1/1/1 2//1 -1\r\nv 0 1 0\nf -4 \\\n -2 \\\r\n 4 # five\nl 1 2\n";
        let mesh = read(text.as_bytes()).unwrap();
        assert_eq!(mesh.positions[1..3], [DVec3::X, DVec3::new(1.0, 1.0, 0.0)]);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        let five = read(format!("{text}f 1 2 3 4 1").as_bytes()).unwrap();
        assert_eq!(five.triangles[2..], [[0, 1, 2], [0, 2, 3], [0, 3, 0]]);
    }

    #[test]
    fn mistakes_have_a_line() {
        let why = |text: &str| read(text.as_bytes()).unwrap_err().to_string();
        assert!(why("v 0 0\n").starts_with("line 1: a vertex without three numbers"));
        let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
        for face in ["f 0 1 2", "f 1 2 -4", "f 1 2 2.9", "f 1 2 nan", "f 1 2 /1", "f 1 2 99999999999"] {
            assert!(why(&format!("{vertices}{face}")).starts_with("line 4: a corner `"), "{face}");
        }
        assert!(why(&format!("{vertices}f 1 2")).starts_with("line 4: a face of fewer"));
    }
}
