//! Makes the bodies in `bodies/`. With `--check`, compares them with what is there instead of writing.

pub(crate) mod figure;
pub(crate) mod hand;
pub(crate) mod humanoid;
pub(crate) mod mat;
pub(crate) mod meeting;
pub(crate) mod solid;
pub(crate) mod touch;

use std::path::Path;
use std::process::ExitCode;

use somatic::Result;
use somatic::body::Body;
use somatic::internal::body::Glb;
use somatic::internal::field::TaxelGraph;

/// Every file that the recipes make: its name in `bodies/`, and its bytes.
pub(crate) fn files() -> Result<Vec<(&'static str, Vec<u8>)>> {
    let hand = hand::make(hand::Senses::Pressure);
    let sensing = hand::make(hand::Senses::All);
    Ok(vec![
        ("hand.glb", with_edges(hand.glb)?),
        ("touch.csv", touch::csv(&hand.sensors).into_bytes()),
        ("sensing-hand.glb", with_edges(sensing.glb)?),
        ("meeting.csv", meeting::csv(&sensing.sensors).into_bytes()),
        ("mat.glb", with_edges(mat::make())?),
        ("humanoid.glb", humanoid::make()?),
    ])
}

/// `glb` with the edges between its taxels.
fn with_edges(mut glb: Glb) -> Result<Vec<u8>> {
    let body = Body::from_bytes("body", &glb.to_bytes()?)?;
    glb.edges(&TaxelGraph::made(&body).to_stored(&body));
    glb.to_bytes()
}

fn main() -> ExitCode {
    let check = std::env::args().any(|argument| argument == "--check");
    match files().and_then(|files| put(&files, check)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn put(files: &[(&str, Vec<u8>)], check: bool) -> Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("bodies");
    for (name, bytes) in files {
        let path = folder.join(name);
        if check {
            let there = std::fs::read(&path).map_err(|e| somatic::Error::io(&path, &e))?;
            if there != *bytes {
                return Err(somatic::Error::failed("not what its recipe makes; run without --check").at(path.display()));
            }
        } else {
            std::fs::write(&path, bytes).map_err(|e| somatic::Error::io(&path, &e))?;
        }
        println!("{name}: {} bytes", bytes.len());
    }
    Ok(())
}
