//! Limbs and others: Zenoh's own package in Python reads them, and TLS and access control keep strangers out.

use std::collections::BTreeMap;
use std::process::{Child, Command, Stdio};
#[cfg(feature = "zenoh-tls")]
use std::time::{Duration, Instant};

use serde_json::Value;

use super::limbs_network::{LIMBS, Limb, Lines, Place, free_port, play, undistributed, wait_for};
use super::python::python_with;
use somatic_testing::skip;

/// Kills a program that a test does not need any more.
struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn zenoh_in_python_reads_what_limbs_send() {
    let python = match python_with("zenoh", "import zenoh") {
        Ok(python) => python,
        Err(why) => return skip("PYTHON", why),
    };
    let (place, port) = (Place::new(), free_port());
    let config = place.config("head.json5", Some(port), None);
    let limb_config = place.config("limb.json5", None, Some(port));
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/zenoh/read.py");
    let mut reader = Command::new(python).args([script, &config, "40"]).stdout(Stdio::piped()).spawn().unwrap();
    let (read, _) = Lines::read(reader.stdout.take().unwrap());
    let _reader = Killed(reader);
    wait_for("Python", || read.has("listening"));
    let mut limbs = [
        Limb::start(LIMBS[0], "zenoh:robot/thumb", &limb_config),
        Limb::start(LIMBS[1], "zenoh-percepts:robot/index", &limb_config),
    ];
    let heard = || read.has("\"frame\", \"layout\"") && read.has("\"percepts\"");
    let row = play(&mut limbs, 0, |_| heard());
    let rows = play(&mut limbs, row, |now| now == row + 50);
    let taxels = limbs[0].taxels.clone();
    limbs.into_iter().for_each(|limb| drop(limb.end()));
    wait_for("the end", || read.all().iter().filter(|line| line.contains("\"end\"")).count() == 2);
    let lines: Vec<Value> = read.all().iter().map(|line| serde_json::from_str(line).unwrap()).collect();
    let of = |key: &str, kind: &str| -> Vec<&Value> {
        lines.iter().filter(|line| line["key"] == key && line["kind"] == kind).collect()
    };
    let layouts = of("robot/thumb", "layout");
    let mut sorted = taxels.clone();
    sorted.sort_unstable();
    let ids =
        |of: &Value| -> Vec<u64> { of["taxels"].as_array().unwrap().iter().map(|id| id.as_u64().unwrap()).collect() };
    assert!(
        !layouts.is_empty()
            && layouts.iter().all(|layout| ids(layout) == sorted.iter().map(|id| u64::from(*id)).collect::<Vec<_>>())
    );
    let frames = of("robot/thumb", "frame");
    let sequences: Vec<u64> = frames.iter().map(|frame| frame["sequence"].as_u64().unwrap()).collect();
    assert!(frames.len() >= 50 && sequences.windows(2).all(|pair| pair[1] == pair[0] + 1), "{sequences:?}");
    for frame in &frames {
        let row = frame["sequence"].as_u64().unwrap();
        let value = |id: &u32| super::limbs_network::value(row, taxels.iter().position(|own| own == id).unwrap());
        let sent: Vec<f64> = sorted.iter().map(value).collect();
        let read: Vec<f64> = frame["values"].as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect();
        assert_eq!(read, sent);
    }
    let all: BTreeMap<String, u64> = undistributed(&place, LIMBS[1], rows);
    for line in of("robot/index", "percepts") {
        assert_eq!(all[&line["fields"][0].to_string()], line["sequence"].as_u64().unwrap());
    }
    assert_eq!(of("robot/index", "end")[0]["sequence"], rows);
}

/// The example of TLS and access control, with certificates made for it.
#[cfg(feature = "zenoh-tls")]
#[test]
fn with_tls_a_limb_sends_what_its_certificate_allows_and_a_stranger_nothing() {
    let place = Place::new();
    let folder = place.path("");
    let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/zenoh");
    let made = Command::new(format!("{examples}/certificates"))
        .args(["localhost", "left_arm", "right_arm", "stranger"])
        .current_dir(&folder)
        .output();
    match made {
        Ok(output) => assert!(output.status.success(), "{}", super::stderr(&output)),
        Err(why) => return skip("OPENSSL", format!("certificates cannot be made: {why}")),
    }
    let port = free_port();
    let config = |name: &str, changes: &[(&str, &str)]| {
        let mut text = std::fs::read_to_string(format!("{examples}/{name}")).unwrap();
        let here = |file: &str| format!("\"{folder}/{file}\"").replace("//", "/");
        for file in ["ca.pem", "head.pem", "head.key", "left_arm.pem", "left_arm.key"] {
            text = text.replace(&format!("\"{file}\""), &here(file));
        }
        text = text.replace("tls/0.0.0.0:7447", &format!("tls/127.0.0.1:{port}"));
        text = text.replace("tls/head.local:7447", &format!("tls/localhost:{port}"));
        for (from, to) in changes {
            assert!(text.contains(from), "{from}: {text}");
            text = text.replace(from, to);
        }
        let path =
            place.path(&format!("{}-{name}", changes.len() + changes.iter().map(|(_, to)| to.len()).sum::<usize>()));
        std::fs::write(&path, text).unwrap();
        path
    };
    let head_config = config("head-tls.json5", &[]);
    let keys = ["robot/left_arm", "robot/right_arm"];
    let head = super::limbs_network::Head::start(&place, &keys, &head_config, &[]);
    let good = config("limb-tls.json5", &[]);
    let certificate = "\n        connect_certificate: ";
    let without = config(
        "limb-tls.json5",
        &[
            (certificate, "\n        // "),
            ("        connect_private_key", "        // "),
            ("enable_mtls: true", "enable_mtls: false"),
        ],
    );
    let stranger = config("limb-tls.json5", &[("left_arm.", "stranger.")]);
    let seconds = |count: u64| Instant::now() + Duration::from_secs(count);
    let heard = |key: &str| head.running.out.has("\"contact\":true") && head.running.reported.has(key);
    for (sender, key, why) in [
        (&without, keys[0], "it shows no certificate"),
        (&stranger, keys[0], "its name is in no rule"),
        (&good, keys[1], "the key is another limb's"),
    ] {
        let mut limbs = [Limb::start(LIMBS[0], key, sender)];
        let until = seconds(4);
        play(&mut limbs, 0, |_| Instant::now() > until);
        let [limb] = limbs;
        drop(limb);
        assert!(
            !head.running.out.has("\"contact\":true") && !heard("the limb"),
            "{why}: {:?}",
            head.running.reported.all()
        );
    }
    // The same head hears the one that may.
    let mut limbs = [Limb::start(LIMBS[0], keys[0], &good)];
    play(&mut limbs, 0, |_| head.running.out.has("\"contact\":true"));
}
