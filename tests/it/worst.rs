//! How much of their bounds the backends really use: the table of docs/evidence/numerics.md.

use std::collections::BTreeMap;

use somatic::{Agreement, BackendKind, Engine, Frame, Options, Outputs, Scene};

use crate::common::{Flat, backends, frame};
use crate::random::Random;

/// What came of comparing `kind` with the reference on `fields` random fields of `taxels` taxels, over `frames` frames.
fn compared(kind: BackendKind, taxels: usize, fields: usize, frames: usize) -> Agreement {
    let mut numbers = Random::new(taxels as u64);
    let between = |numbers: &mut Random, low: f64, high: f64| low + (high - low) * numbers.unit();
    let mut uv: Vec<[f64; 2]> = Vec::with_capacity(taxels * fields);
    let mut decades = Vec::with_capacity(fields);
    for _ in 0..fields {
        let size = 10.0_f64.powf(between(&mut numbers, -3.0, 1.0));
        let off_centre = between(&mut numbers, 0.0, 3.0);
        let mut at = |centre: f64| size * (centre + between(&mut numbers, -1.0, 1.0));
        uv.extend((0..taxels).map(|_| [at(off_centre), at(0.0)]));
        decades.push(between(&mut numbers, 0.0, 8.0));
    }
    let ids = |field: usize| (field * taxels) as u32..((field + 1) * taxels) as u32;
    let skin = (0..fields).fold(Flat::new(&uv), |skin, field| skin.field(&format!("{field:05}"), None, ids(field)));
    let mut value = |n: usize| match numbers.unit() < 0.2 {
        true => 0.0,
        false => 10.0_f64.powf(between(&mut numbers, 0.0, decades[n / taxels])),
    };
    let recording: Vec<Frame> =
        (0..frames).map(|n| frame(n as f64 * 0.01, &(0..uv.len()).map(&mut value).collect::<Vec<_>>())).collect();
    // No surface: what a lift loses is the lift's.
    let outputs = Scene::default().outputs - Outputs::POSITION - Outputs::NORMAL;
    let scene = Scene::default().outputs(outputs);
    let mut engine = Engine::new(&skin.body(), Options::default().backend(kind).scene(scene).batch(frames)).unwrap();
    engine.process_and_compare(&recording).unwrap().1
}

#[test]
#[ignore = "a measurement: run it by name with --nocapture"]
fn how_much_of_its_bound_each_quantity_uses() {
    let sizes = [(2, 500, 40), (9, 500, 40), (64, 200, 40), (1000, 20, 20), (30_000, 4, 4), (1_000_000, 1, 2)];
    for kind in backends().into_iter().filter(|&kind| kind != BackendKind::Reference) {
        let mut shares: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for (taxels, fields, frames) in sizes {
            let agreement = compared(kind, taxels, fields, frames);
            assert!(agreement.holds(), "{kind:?}, {taxels} taxels: {agreement}");
            for (name, comparison) in &agreement.quantities {
                shares.entry(name.clone()).or_default().push(match comparison.compared {
                    0 => "–".to_owned(),
                    _ if comparison.worst_share < 5e-3 => format!("{:.0e}", comparison.worst_share),
                    _ => format!("{:.2}", comparison.worst_share),
                });
            }
        }
        let heads: Vec<String> = sizes.iter().map(|(taxels, ..)| taxels.to_string()).collect();
        println!("{kind:?}\n| quantity | {} |\n|---|{}", heads.join(" | "), "---|".repeat(sizes.len()));
        for (name, shares) in shares {
            println!("| {name} | {} |", shares.join(" | "));
        }
    }
}
