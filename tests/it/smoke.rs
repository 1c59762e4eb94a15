use crate::common::*;
use somatic::*;
#[test]
fn mat() {
    let uv: Vec<[f64; 2]> = (0..2048).map(|i| [(i % 32) as f64 * 0.0254, -((i / 32) as f64) * 0.0254]).collect();
    let mut flat = Flat::new(&uv).field("mat", None, 0..2048);
    for r in 0..16 {
        for c in 0..8 {
            let ids: Vec<u32> = (0..16).map(|k| (r * 4 + k / 4) * 32 + c * 4 + k % 4).collect();
            flat = flat.field(&format!("mat/{r}_{c}"), Some("mat"), ids);
        }
    }
    let body = flat.surface(3.0).body();
    let Some(data) = data() else { return };
    for n in 1..=6 {
        let text = std::fs::read_to_string(data.join(format!("recordings/mat/posture_{n}.csv"))).unwrap();
        let frames: Vec<Frame> = text
            .lines()
            .skip(1)
            .map(|l| {
                let v: Vec<f64> = l.split(',').map(|x| x.parse().unwrap()).collect();
                frame(v[0], &v[1..])
            })
            .collect();
        for k in backends() {
            let mut e = engine(&body, k);
            let t = std::time::Instant::now();
            let (_, a) = e.process_and_compare(&frames).unwrap();
            println!("{n} {k:?} {:?} {a}", t.elapsed());
            assert!(a.holds());
        }
    }
}
