//! The bundled touch: whole counts on the hand's channels that tell of taps, a rod and a stroke, in that order.

use std::path::Path;

use glam::DVec3;
use somatic::Body;

/// Times in s, and per frame the counts of each channel.
struct Touch {
    channels: Vec<u32>,
    frames: Vec<(f64, Vec<u32>)>,
}

fn bundled(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("bodies").join(name)
}

fn touch() -> Touch {
    let text = std::fs::read_to_string(bundled("touch.csv")).unwrap();
    let mut rows = text.lines().map(|line| line.split(',').collect::<Vec<&str>>());
    let header = rows.next().unwrap();
    assert_eq!(header[0], "t");
    let channels = header[1..].iter().map(|id| id.parse().unwrap()).collect();
    let frames = rows.map(|row| (row[0].parse().unwrap(), row[1..].iter().map(|n| n.parse().unwrap()).collect()));
    Touch { channels, frames: frames.collect() }
}

impl Touch {
    /// The channels pressed between `start` and `end` (s), ascending.
    fn pressed(&self, start: f64, end: f64) -> Vec<u32> {
        let during = || self.frames.iter().filter(|(t_s, _)| (start..end).contains(t_s));
        let is_pressed = |&k: &usize| during().any(|(_, counts)| counts[k] > 0);
        (0..self.channels.len()).filter(is_pressed).map(|k| self.channels[k]).collect()
    }

    /// The pressure's mean place on the hand, for each frame between `start` and `end` in which it is touched.
    fn path(&self, body: &Body, start: f64, end: f64) -> Vec<DVec3> {
        let place = |id: u32| body.taxels[body.taxel_index(id).unwrap()].position_in_link;
        let during =
            self.frames.iter().filter(|(t_s, counts)| (start..end).contains(t_s) && counts.iter().sum::<u32>() > 0);
        during
            .map(|(_, counts)| {
                let sum: DVec3 = self.channels.iter().zip(counts).map(|(&id, &n)| place(id) * f64::from(n)).sum();
                sum / f64::from(counts.iter().sum::<u32>())
            })
            .collect()
    }
}

#[test]
fn it_has_the_hands_channels_at_50_hz_in_10_bits() {
    let touch = touch();
    let body = Body::load(bundled("hand.glb")).unwrap();
    assert_eq!(touch.channels, body.taxels.iter().map(|taxel| taxel.id).collect::<Vec<u32>>());
    assert!((200..=300).contains(&touch.frames.len()));
    assert!(touch.frames.iter().enumerate().all(|(n, (t_s, _))| (t_s - n as f64 / 50.0).abs() < 1e-9));
    assert!(touch.frames.iter().all(|(_, counts)| counts.len() == 40));
    let most = touch.frames.iter().flat_map(|(_, counts)| counts).max().unwrap();
    assert!((500..=1023).contains(most), "{most} counts");
    let (first, last) = (&touch.frames[0].1, &touch.frames[touch.frames.len() - 1].1);
    assert!(first.iter().chain(last).all(|&n| n == 0), "it starts and ends untouched");
}

#[test]
fn it_taps_one_finger_after_the_other() {
    let touch = touch();
    for (finger, start) in [0.2, 0.6, 1.0, 1.4].into_iter().enumerate() {
        let first = 32 + 5 * finger as u32;
        let pressed = touch.pressed(start, start + 0.3);
        assert!(pressed.iter().all(|id| (first..first + 5).contains(id)), "{pressed:?}");
        assert!([2, 3, 4].iter().all(|pad| pressed.contains(&(first + pad))), "{pressed:?}");
        assert!(touch.pressed(start + 0.3, start + 0.39).is_empty());
    }
}

#[test]
fn the_rod_rolls_over_the_whole_back_from_the_fingers_to_the_wrist() {
    let touch = touch();
    let body = Body::load(bundled("hand.glb")).unwrap();
    assert_eq!(touch.pressed(2.0, 3.65), (16..25).collect::<Vec<u32>>());
    let path = touch.path(&body, 2.1, 3.5);
    assert!(path[0].z > 0.008 && path[path.len() - 1].z < -0.008);
    assert!(path.windows(2).filter(|pair| pair[1].z > pair[0].z).count() <= path.len() / 10);
    // A slanted rod meets the outer columns at different times.
    let highest = |id: u32| {
        let k = touch.channels.iter().position(|&channel| channel == id).unwrap();
        let during = touch.frames.iter().filter(|(t_s, _)| (2.0..3.65).contains(t_s));
        during.max_by_key(|(_, counts)| counts[k]).unwrap().0
    };
    assert!((highest(19) - highest(21)).abs() > 0.2);
}

#[test]
fn the_stroke_bends_across_the_palm() {
    let touch = touch();
    let body = Body::load(bundled("hand.glb")).unwrap();
    assert!(touch.pressed(3.75, 5.5).iter().all(|&id| id < 9));
    let path = touch.path(&body, 3.8, 5.4);
    let (first, middle, last) = (path[0], path[path.len() / 2], path[path.len() - 1]);
    assert!(last.x - first.x > 0.012, "it goes to the thumb's side");
    assert!(middle.z > first.z + 0.004 && middle.z > last.z + 0.004, "and bends by the fingers");
}
