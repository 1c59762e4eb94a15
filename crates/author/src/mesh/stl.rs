//! Reads STL, binary and text.

use glam::DVec3;

use super::triangles::Triangles;
use crate::error::{Error, Result, failed};

/// Bytes before the triangles of a binary file; the last four are the number of triangles.
const HEADER: usize = 84;
/// Bytes of a triangle: a normal, three corners, and two bytes that say nothing.
const TRIANGLE: usize = 50;

/// The triangles of an STL file.
///
/// Many programs begin the header of a binary file with `solid`, as a text does: its size decides.
pub(super) fn read(bytes: &[u8]) -> Result<Triangles> {
    let count = bytes.get(HEADER - 4..HEADER).map(|own| u32::from_le_bytes([own[0], own[1], own[2], own[3]]));
    let is_exact = |count: u32| bytes.len() as u64 == HEADER as u64 + TRIANGLE as u64 * u64::from(count);
    let text = bytes.trim_ascii_start();
    let is_text = text.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
        && !bytes[..bytes.len().min(HEADER + TRIANGLE)].contains(&0);
    match count {
        Some(count) if is_exact(count) => Ok(binary(&bytes[HEADER..])),
        _ if is_text => of_text(bytes),
        Some(count) => Err(failed!(
            "not a valid STL mesh: {count} triangles would be {} bytes, and it has {}; copy or export it again",
            HEADER as u64 + TRIANGLE as u64 * u64::from(count),
            bytes.len()
        )),
        None => Err(Error::failed("not a valid STL mesh: it is too short; copy or export it again")),
    }
}

fn binary(body: &[u8]) -> Triangles {
    let mut mesh = Triangles::default();
    for triangle in body.chunks_exact(TRIANGLE) {
        let first = mesh.positions.len() as u32;
        for corner in triangle[12..48].chunks_exact(12) {
            let axis = |at: usize| f64::from(f32::from_le_bytes([0, 1, 2, 3].map(|byte| corner[at + byte])));
            mesh.positions.push(DVec3::new(axis(0), axis(4), axis(8)));
        }
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh
}

/// `solid NAME`, then of each triangle `facet normal x y z outer loop`, three `vertex x y z`, `endloop endfacet`, then
/// `endsolid NAME`: in upper or lower case, and several solids in one file.
fn of_text(bytes: &[u8]) -> Result<Triangles> {
    let mut mesh = Triangles::default();
    let mut words = Words { rest: bytes, line: 1 };
    let mut is_open = false;
    while let Some(word) = words.next() {
        match &word.to_ascii_lowercase()[..] {
            b"solid" if !is_open => is_open = true,
            b"endsolid" if is_open => is_open = false,
            b"facet" if is_open => {
                words.skip_to(b"outer")?;
                words.want(b"loop")?;
                let first = mesh.positions.len() as u32;
                for _ in 0..3 {
                    words.want(b"vertex")?;
                    let place = DVec3::new(words.number()?, words.number()?, words.number()?);
                    mesh.positions.push(place);
                }
                words.want(b"endloop")?;
                words.want(b"endfacet")?;
                mesh.triangles.push([first, first + 1, first + 2]);
                continue;
            }
            _ => return Err(words.wrong(word, "a facet")),
        }
        // A name may be anything.
        words.skip_line();
    }
    if is_open {
        return Err(Error::failed("not a valid STL mesh: it has no `endsolid`; copy or export it again"));
    }
    Ok(mesh)
}

/// Words between spaces, with the line of the last one.
struct Words<'a> {
    rest: &'a [u8],
    line: usize,
}

impl<'a> Words<'a> {
    fn next(&mut self) -> Option<&'a [u8]> {
        let begin = self.rest.iter().position(|byte| !byte.is_ascii_whitespace())?;
        self.line += self.rest[..begin].iter().filter(|&&byte| byte == b'\n').count();
        let word = &self.rest[begin..];
        let end = word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len());
        self.rest = &word[end..];
        Some(&word[..end])
    }

    fn skip_line(&mut self) {
        let end = self.rest.iter().position(|&byte| byte == b'\n').unwrap_or(self.rest.len());
        self.rest = &self.rest[end..];
    }

    /// A facet's normal, which the corners give too.
    fn skip_to(&mut self, wanted: &[u8]) -> Result<()> {
        for _ in 0..5 {
            match self.next() {
                Some(word) if word.eq_ignore_ascii_case(wanted) => return Ok(()),
                Some(_) => {}
                None => break,
            }
        }
        Err(self.wrong(b"", "`outer loop`"))
    }

    fn want(&mut self, wanted: &[u8]) -> Result<()> {
        let word = self.next().unwrap_or_default();
        let is_wanted = word.eq_ignore_ascii_case(wanted);
        is_wanted.then_some(()).ok_or_else(|| self.wrong(word, &format!("`{}`", String::from_utf8_lossy(wanted))))
    }

    fn number(&mut self) -> Result<f64> {
        let word = self.next().unwrap_or_default();
        let number = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
        number.ok_or_else(|| self.wrong(word, "a number"))
    }

    fn wrong(&self, word: &[u8], wanted: &str) -> Error {
        let instead = match word {
            b"" => String::new(),
            word => format!(", not `{}`", String::from_utf8_lossy(word)),
        };
        failed!("not a valid STL mesh: {wanted} was to come{instead}; export it again")
            .at(format!("line {}", self.line))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "solid a name\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e0 0\n\
                        endloop\nendfacet\nendsolid a name\n";

    #[test]
    fn a_binary_file_that_says_solid_is_binary() {
        let mut bytes = b"solid made by a program that does not know better".to_vec();
        bytes.resize(80, b' ');
        bytes.extend(1_u32.to_le_bytes());
        bytes.extend([0; 12]);
        for x in [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
            bytes.extend(x.to_le_bytes());
        }
        bytes.extend([0; 2]);
        let mesh = read(&bytes).unwrap();
        assert_eq!(mesh.positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
        assert_eq!(mesh.positions, read(TEXT.as_bytes()).unwrap().positions);
        assert_eq!(read(&bytes[..133]).unwrap_err().to_string().matches('\n').count(), 0);
        bytes[0] = b'x';
        let why = read(&bytes[..133]).unwrap_err().to_string();
        assert!(why.contains("1 triangles would be 134 bytes, and it has 133"), "{why}");
        // No room is made for what a header only claims.
        bytes[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(read(&bytes).unwrap_err().to_string().contains("4294967295 triangles"));
    }

    #[test]
    fn text_is_read_in_any_case_and_its_mistakes_have_a_line() {
        let whole = read(TEXT.as_bytes()).unwrap();
        for other in [TEXT.to_uppercase(), TEXT.replace('\n', "\r\n"), format!(" \n{TEXT}{TEXT}")] {
            let mesh = read(other.as_bytes()).unwrap();
            assert_eq!(mesh.positions[..3], whole.positions[..]);
            assert_eq!(mesh.triangles[0], [0, 1, 2]);
        }
        let one_line = format!("solid name\n{}", TEXT.split_once('\n').unwrap().1.replace('\n', " "));
        assert_eq!(read(one_line.as_bytes()).unwrap().positions, whole.positions);
        for (part, other, wanted) in [
            ("vertex 1 0 0", "vertex 1 0", "line 6: not a valid STL mesh: a number was to come, not `vertex`"),
            ("vertex 1 0 0\n", "", "line 6: not a valid STL mesh: `vertex` was to come, not `endloop`"),
            ("endloop", "vertex 1 1 1", "line 7: not a valid STL mesh: `endloop` was to come, not `vertex`"),
            ("endfacet\n", "", "line 8: not a valid STL mesh: `endfacet` was to come, not `endsolid`"),
            ("endsolid a name\n", "", "it has no `endsolid`"),
            ("outer", "inner", "`outer loop` was to come"),
            ("facet normal", "face", "line 2: not a valid STL mesh: a facet was to come, not `face`"),
        ] {
            let why = read(TEXT.replace(part, other).as_bytes()).unwrap_err().to_string();
            assert!(why.contains(wanted), "{why}");
        }
    }
}
