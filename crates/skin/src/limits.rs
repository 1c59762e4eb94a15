//! How much a file, or a number in it, may ask for.
//!
//! Files come from anywhere. Whatever one of them says, reading it ends soon, in memory that this table bounds: sizes are
//! checked before a file is read whole, counts before room is made for them, depths before a parser follows them. What is
//! beyond a limit is refused in a line that names it. `docs/reference/limits.md` has the same table.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// A limit of the [`TABLE`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit {
    /// The constant's name.
    pub name: &'static str,
    /// What it limits.
    pub what: &'static str,
    /// The most that is accepted.
    pub most: u64,
    /// Whether it counts bytes.
    pub in_bytes: bool,
}

/// Declares each limit as a constant, and all of them as a table.
macro_rules! limits {
    ($($(#[doc = $what:literal])+ $name:ident: $kind:tt = $value:expr;)+) => {
        $($(#[doc = $what])+ pub const $name: $kind = $value;)+

        /// All limits, in the order of `docs/reference/limits.md`.
        pub const TABLE: &[Limit] = &[
            $(Limit {
                name: stringify!($name),
                what: concat!($($what),+).trim_ascii(),
                most: $name as u64,
                in_bytes: limits!(@in_bytes $kind),
            },)+
        ];
    };
    (@in_bytes u64) => { true };
    (@in_bytes $count:tt) => { false };
}

// Sizes in bytes are `u64`, counts and depths are not.
limits! {
    /// Size of a file in TOML: a scene, recipe, calibration, simulation or wiring, or the rules of `--mjcf-rules`
    MAX_TOML_BYTES: u64 = 16 << 20;
    /// Size of a file in XML: a URDF, MJCF or COLLADA mesh
    MAX_XML_BYTES: u64 = 256 << 20;
    /// Size of a body, `.glb` or `.gltf`, and of all the buffers beside it together
    MAX_BODY_BYTES: u64 = 1 << 30;
    /// Size of a mesh in STL, OBJ or PLY
    MAX_MESH_BYTES: u64 = 1 << 30;
    /// Size of a table of taxels, of a mask, or of a position file of an iCub
    MAX_TABLE_BYTES: u64 = 256 << 20;
    /// Size of a recording of joint states as a table or NDJSON, which is kept in memory
    MAX_STATES_BYTES: u64 = 1 << 30;
    /// Size of what a recorder writes beside a bag or a dataset, `metadata.yaml` or `info.json`
    MAX_METADATA_BYTES: u64 = 16 << 20;
    /// Size of a chunk of an MCAP when it is unpacked, of its summary, or of a message of a bag in SQLite
    MAX_CHUNK_BYTES: u64 = 256 << 20;
    /// Size of what is kept between runs, or read of the operating system
    MAX_SYSTEM_BYTES: u64 = 16 << 20;
    /// What is read of a device, such as `/dev/stdin` at a terminal, in place of a file
    MAX_DEVICE_BYTES: u64 = 1 << 20;
    /// Length of a line of a recording as a table, NDJSON or an export
    MAX_LINE_BYTES: u64 = 64 << 20;
    /// Size of a recording in `.gz` when it is unpacked
    MAX_UNPACKED_BYTES: u64 = 8 << 30;

    /// Elements of an XML file within each other
    MAX_XML_DEPTH: usize = 500;
    /// Nodes of an XML file: elements, and texts between them
    MAX_XML_NODES: u32 = 20_000_000;
    /// Attributes of an XML element
    MAX_XML_ATTRIBUTES: usize = 128;
    /// `xmlns` attributes of an XML file
    MAX_XML_NAMESPACES: usize = 1000;
    /// Files of an MJCF that include each other, one within the other
    MAX_INCLUDE_DEPTH: usize = 32;
    /// Files that an MJCF includes
    MAX_INCLUDES: usize = 1000;
    /// Attributes that the `<default>` classes of an MJCF have from those above them
    MAX_DEFAULTS: usize = 1_000_000;
    /// Triangles that the bins of the touch grids of an MJCF are compared with
    MAX_RAY_TESTS: usize = 1_000_000_000;
    /// Nodes of a glTF
    MAX_NODES: usize = 1_000_000;
    /// Objects in the JSON of a glTF
    MAX_JSON_OBJECTS: usize = 4_000_000;
    /// Nodes of a glTF within each other
    MAX_NODE_DEPTH: usize = 1000;
    /// Triangles of a body, of all meshes as often as they are placed
    MAX_TRIANGLES: usize = 50_000_000;
    /// Vertices of a body, of all meshes as often as they are placed
    MAX_VERTICES: usize = 100_000_000;
    /// Elements of a glTF accessor without data
    MAX_ZERO_ELEMENTS: usize = 1 << 22;

    /// Taxels that a place of a recipe, a table of taxels or `--taxels` makes
    MAX_TAXELS: usize = 4_000_000;
    /// Cells of a sheet, or taxels of an array in a URDF or a touch grid in an MJCF
    MAX_CELLS: usize = 1_000_000;
    /// Places of a recipe
    MAX_PLACES: usize = 4096;
    /// Fields that rules or a sheet's regions make
    MAX_FIELDS: usize = 500_000;
    /// Fields of a body within each other
    MAX_FIELD_DEPTH: usize = 100;
    /// Members of all fields that rules make
    MAX_MEMBERS: usize = 20_000_000;
}

/// What [`std::fs::read`] gives, of at most `most` bytes.
///
/// # Errors
/// As [`std::fs::read`]; and [`io::ErrorKind::FileTooLarge`], without having read a file that is longer, and having read no
/// more than `most` bytes of a pipe, or [`MAX_DEVICE_BYTES`] of a device.
pub fn read(path: impl AsRef<Path>, most: u64) -> io::Result<Vec<u8>> {
    let mut reader = open(path, most)?;
    let mut bytes = Vec::with_capacity(usize::try_from(reader.length.min(most)).unwrap_or(0));
    reader.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// What [`std::fs::read_to_string`] gives, of at most `most` bytes.
///
/// # Errors
/// As [`read`]; and [`io::ErrorKind::InvalidData`] if it is not UTF-8.
pub fn read_to_string(path: impl AsRef<Path>, most: u64) -> io::Result<String> {
    String::from_utf8(read(path, most)?).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        io::Error::new(io::ErrorKind::InvalidData, format!("it is not text: byte {at} is not UTF-8; save it as UTF-8"))
    })
}

/// The file at `path`; at most `most` bytes of it can be read.
///
/// # Errors
/// As [`read`].
pub fn open(path: impl AsRef<Path>, most: u64) -> io::Result<LimitedFile> {
    let path = path.as_ref();
    let file = File::open(path)?;
    let about = file.metadata()?;
    if about.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    let length = if about.is_file() { about.len() } else { 0 };
    if length > most {
        return Err(too_large(&format!("it has {}", size(length)), "a file of this kind", most));
    }
    // A device may be endless, and gives its bytes fast.
    let is_device = !about.is_file() && !is_pipe(&about);
    let most = if is_device { most.min(MAX_DEVICE_BYTES) } else { most };
    Ok(LimitedFile { file, left: most, most, length, is_device })
}

#[cfg(unix)]
fn is_pipe(about: &std::fs::Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt as _;
    about.file_type().is_fifo() || about.file_type().is_socket()
}

#[cfg(not(unix))]
fn is_pipe(_: &std::fs::Metadata) -> bool {
    true
}

/// A file that gives no more than its limit.
#[derive(Debug)]
pub struct LimitedFile {
    file: File,
    left: u64,
    most: u64,
    /// In bytes, as the file system has it; 0 of what is not a file.
    length: u64,
    is_device: bool,
}

impl Read for LimitedFile {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        if to.is_empty() {
            return Ok(0);
        }
        if self.left == 0 {
            let more = self.file.read(&mut [0])?;
            let kind = if self.is_device { "a device" } else { "a file of this kind" };
            return if more == 0 { Ok(0) } else { Err(too_large("it goes on", kind, self.most)) };
        }
        let room = usize::try_from(self.left).unwrap_or(usize::MAX).min(to.len());
        let count = self.file.read(&mut to[..room])?;
        self.left -= count as u64;
        Ok(count)
    }
}

fn too_large(how: &str, kind: &str, most: u64) -> io::Error {
    let what = format!("{how}, and {kind} may have at most {}; is it the right one?", size(most));
    io::Error::new(io::ErrorKind::FileTooLarge, what)
}

/// `bytes` in words.
#[must_use]
pub fn size(bytes: u64) -> String {
    let units = [(1 << 30, "GiB"), (1 << 20, "MiB"), (1 << 10, "KiB")];
    match units.into_iter().find(|&(unit, _)| bytes >= unit) {
        Some((unit, name)) if bytes.is_multiple_of(unit) => format!("{} {name}", bytes / unit),
        Some((unit, name)) => format!("{:.1} {name}", bytes as f64 / unit as f64),
        None => format!("{bytes} bytes"),
    }
}

impl std::fmt::Display for Limit {
    /// The most, as `docs/reference/limits.md` has it: `64 MiB`, or `4,000,000`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.in_bytes {
            return f.write_str(&size(self.most));
        }
        let digits = self.most.to_string();
        for (at, digit) in digits.chars().enumerate() {
            let comma = if at > 0 && (digits.len() - at).is_multiple_of(3) { "," } else { "" };
            write!(f, "{comma}{digit}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_within_its_limit_is_read_and_a_longer_one_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        std::fs::write(&path, "abcde").unwrap();
        assert_eq!(read(&path, 5).unwrap(), b"abcde");
        let error = read(&path, 4).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
        assert_eq!(
            error.to_string(),
            "it has 5 bytes, and a file of this kind may have at most 4 bytes; is it the right one?"
        );
        std::fs::write(&path, b"ab\xFF").unwrap();
        assert!(read_to_string(&path, 5).unwrap_err().to_string().contains("byte 2 is not UTF-8"));
        assert_eq!(read(folder.path(), 5).unwrap_err().kind(), io::ErrorKind::IsADirectory);
        assert_eq!(read(folder.path().join("none"), 5).unwrap_err().kind(), io::ErrorKind::NotFound);
    }

    #[test]
    #[cfg(unix)]
    fn a_device_without_end_is_refused() {
        let error = read("/dev/zero", MAX_BODY_BYTES).unwrap_err();
        assert!(error.to_string().contains("it goes on, and a device may have at most 1 MiB"), "{error}");
        assert_eq!(read("/dev/null", 5).unwrap(), b"");
    }

    #[test]
    fn a_file_that_grows_meanwhile_is_read_to_its_limit() {
        use std::io::Write as _;
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(b"abc").unwrap();
        let mut reader = open(file.path(), 4).unwrap();
        file.write_all(b"defg").unwrap();
        let mut bytes = Vec::new();
        assert_eq!(reader.read_to_end(&mut bytes).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
        assert_eq!(bytes, b"abcd");
    }

    #[test]
    fn the_documentation_has_the_table() {
        let page =
            std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/reference/limits.md")).unwrap();
        let rows: Vec<&str> = page.lines().filter(|line| line.starts_with("| ") && line.contains('`')).collect();
        let wanted: Vec<String> =
            TABLE.iter().map(|limit| format!("| {} | {limit} | `{}` |", limit.what, limit.name)).collect();
        assert_eq!(rows, wanted, "write these rows into docs/reference/limits.md:\n{}", wanted.join("\n"));
        assert!(wanted[0].ends_with("| 16 MiB | `MAX_TOML_BYTES` |"), "{}", wanted[0]);
    }
}
