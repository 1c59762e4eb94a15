//! The page's own files, which are in the binary.

/// A file of the page.
#[derive(Debug)]
pub(super) struct PageFile {
    /// Its path in a request.
    pub(super) path: &'static str,
    /// Its media type.
    pub(super) media_type: &'static str,
    pub(super) bytes: &'static [u8],
}

/// Files of `crates/page/src/web`, each at `/` and its name.
macro_rules! files {
    ($($name:literal),* $(,)?) => {
        &[$(PageFile {
            path: concat!("/", $name),
            media_type: media_type($name),
            bytes: include_bytes!(concat!("web/", $name)),
        }),*]
    };
}

/// One line a file.
const FILES: &[PageFile] = files![
    "address.js",
    "aim.js",
    "arrows.js",
    "boards.js",
    "body.js",
    "box_tree.js",
    "camera.js",
    "chart.js",
    "choices.js",
    "csv.js",
    "self_contacts.js",
    "dirty.js",
    "dom.js",
    "explain.js",
    "field_tree.js",
    "fields.js",
    "format.js",
    "fragment.js",
    "gl.js",
    "hold.js",
    "index.html",
    "inspect.js",
    "keylist.js",
    "keys.js",
    "legend.js",
    "log.js",
    "main.js",
    "math.js",
    "measure.js",
    "model.js",
    "outputs.css",
    "panels.css",
    "pair.css",
    "pair.html",
    "pair.js",
    "paired.js",
    "peaks.js",
    "percepts.js",
    "photo.js",
    "pick.js",
    "places.js",
    "plot.js",
    "plot_file.js",
    "plots.js",
    "reasons.js",
    "reported.js",
    "rest.js",
    "scale_bar.js",
    "senses.js",
    "socket.js",
    "span.js",
    "spots.js",
    "stage.css",
    "status.js",
    "style.css",
    "surface.js",
    "taxel_ids.js",
    "taxels.js",
    "theme.js",
    "timeline.js",
    "timeline_pointer.js",
    "tokens.js",
    "toolbar.js",
    "touch_panel.js",
    "touch_plot.js",
    "video.js",
    "view.js",
    "webm.js",
    "wire.js",
];

/// The page's front door.
const INDEX: &str = "/index.html";

/// The file at exactly `path`.
pub(super) fn file(path: &str) -> Option<&'static PageFile> {
    let path = if path == "/" { INDEX } else { path };
    FILES.iter().find(|file| file.path == path)
}

const fn media_type(name: &str) -> &'static str {
    match extension(name.as_bytes()) {
        b"html" => "text/html; charset=utf-8",
        b"js" => "text/javascript; charset=utf-8",
        b"css" => "text/css; charset=utf-8",
        b"svg" => "image/svg+xml",
        b"png" => "image/png",
        b"json" => "application/json",
        _ => "application/octet-stream",
    }
}

const fn extension(name: &[u8]) -> &[u8] {
    let mut at = name.len();
    while at > 0 && name[at - 1] != b'.' {
        at -= 1;
    }
    name.split_at(at).1
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// The names of what is served below `folder`, which `below` leads to.
    fn names(folder: &Path, below: &str, found: &mut Vec<String>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let entry = entry.unwrap();
            let name = format!("{below}{}", entry.file_name().to_str().unwrap());
            if entry.path().is_dir() {
                names(&entry.path(), &format!("{name}/"), found);
            } else if ["html", "js", "css", "svg", "png"].iter().any(|kind| name.ends_with(&format!(".{kind}"))) {
                found.push(name);
            }
        }
    }

    #[test]
    fn every_file_of_the_page_is_served() {
        let mut found = Vec::new();
        names(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src/web"), "", &mut found);
        for name in &found {
            assert!(file(&format!("/{name}")).is_some(), "add \"{name}\" to FILES");
        }
        assert_eq!(FILES.len(), found.len());
    }

    #[test]
    fn paths_are_exact() {
        assert_eq!(file("/").map(|file| file.path), Some("/index.html"));
        for path in ["", "/../Cargo.toml", "/index.html/", "//index.html", "/index.html?x", "/%69ndex.html", "/web/"] {
            assert!(file(path).is_none(), "{path}");
        }
    }
}
