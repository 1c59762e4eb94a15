//! Recordings that pressure systems export: the makers' own totals in real ones, variants and damage in ones made here.

#[path = "../it/common.rs"]
mod common;
mod damaged;
mod insoles;
mod make;
mod oracle;
mod soles;
mod variants;

use std::path::{Path, PathBuf};

use somatic::internal::source::Layout;
use somatic::source::{Source as _, VendorFormat, VendorOptions, VendorSource};
use somatic::{Frame, RawValue, Result};

/// What is read of a file.
#[derive(Debug, PartialEq)]
struct Read {
    format: VendorFormat,
    layout: Layout,
    ids: Vec<u32>,
    frames: Vec<(f64, Vec<RawValue>)>,
    losses: Vec<String>,
}

/// All of the file at `path`.
fn read(path: &Path, options: &VendorOptions) -> Result<Read> {
    let mut source = VendorSource::open(path, options)?;
    let mut frame = Frame::missing(0.0, source.taxels().len());
    let mut frames = Vec::new();
    while source.next_frame(&mut frame)? {
        frames.push((frame.t_s, frame.values.clone()));
    }
    assert!(!source.next_frame(&mut frame)?, "the end stays the end");
    Ok(Read {
        format: source.format(),
        layout: source.layout().clone(),
        ids: source.taxels().to_vec(),
        frames,
        losses: source.losses(),
    })
}

/// A file of `bytes`, with the folder that it is in.
fn file(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

/// All of a file of `bytes`.
fn read_bytes(name: &str, bytes: &[u8], options: &VendorOptions) -> Result<Read> {
    let (_folder, path) = file(name, bytes);
    read(&path, options)
}
