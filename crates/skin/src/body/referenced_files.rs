//! The files that a body is made of.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::document::split;
use super::model::Body;

use crate::limits::{self, MAX_BODY_BYTES};

impl Body {
    /// The file at `path` and the files of its buffers and images, as far as it can be read. A program that reads the body
    /// must not overwrite them.
    #[must_use]
    pub fn files(path: impl AsRef<Path>) -> Vec<PathBuf> {
        let path = path.as_ref();
        let mut files = vec![path.to_owned()];
        // A device may be endless.
        let bytes = if path.is_file() { limits::read(path, MAX_BODY_BYTES).unwrap_or_default() } else { Vec::new() };
        let Ok(root) = split(&bytes).map(|(text, _)| serde_json::from_slice::<Value>(text).unwrap_or_default()) else {
            return files;
        };
        let folder = path.parent().unwrap_or(Path::new(""));
        let parts = ["buffers", "images"].into_iter().filter_map(|key| root[key].as_array()).flatten();
        let uris = parts.filter_map(|part| part["uri"].as_str()).filter(|uri| !uri.starts_with("data:"));
        files.extend(
            uris.filter_map(|uri| Some(folder.join(&*percent_encoding::percent_decode_str(uri).decode_utf8().ok()?))),
        );
        files
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_names_the_files_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.gltf");
        let text = r#"{"asset":{"version":"2.0"},"buffers":[{"uri":"my%20arm.bin"},{"uri":"data:,x"},{}],
            "images":[{"uri":"skin.png"},{"bufferView":0}]}"#;
        std::fs::write(&path, text).unwrap();
        assert_eq!(Body::files(&path), [path, folder.path().join("my arm.bin"), folder.path().join("skin.png")]);
        let none = folder.path().join("none.glb");
        assert_eq!(Body::files(&none), [none]);
    }
}
