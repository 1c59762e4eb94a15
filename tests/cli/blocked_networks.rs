//! Networks that block: percepts go on, and what is left out is counted.

use std::collections::BTreeMap;
use std::io::Write;
use std::thread;
use std::time::{Duration, Instant};

use serde_json::json;

use super::done;

/// The frame `number` of a sheet of `taxels` taxels as a line for standard input: the peak says which it is.
fn frame(taxels: u64, number: u64) -> String {
    let values: BTreeMap<String, u64> = (0..taxels).map(|id| (id.to_string(), 1 + (id + number) % 90)).collect();
    let mut line = json!({"t": Duration::from_millis(4 * number).as_secs_f64(), "values": values});
    line["values"]["0"] = json!(peak(number));
    line.to_string()
}

fn peak(number: u64) -> u64 {
    1000 + number
}

#[cfg(feature = "zenoh")]
#[test]
fn a_limb_goes_on_behind_a_network_that_blocks_and_both_sides_count_what_is_left_out() {
    use super::limbs_network::{Head, Lines, PERIOD, Place, Running, free_port, number, wait_for};
    use super::relay::{Link, Relay};

    let place = Place::new();
    let body = place.path("sheet.glb");
    done(&["author", "--grid", "50x50", "--pitch", "5mm", "-o", &body]);
    let port = free_port();
    let relay = Relay::start("127.0.0.1", format!("127.0.0.1:{port}"), Duration::ZERO, Duration::ZERO).unwrap();
    let of_skin = ["--body", &body, "--outputs", "peak"];
    let head_config = place.config("head.json5", Some(port), None);
    let head = Head::start_with(&place, &["sheet"], &head_config, &[&of_skin[..], &["--live-rate", "0"]].concat());
    let limb_config = place.config("limb.json5", None, Some(relay.port));
    let arguments = ["run", "--source", "-", "--backend", "cpu", "--sink", "-", "--sink", "zenoh:sheet"];
    let mut limb = Running::start(None, &[&arguments[..], &of_skin, &["--zenoh-config", &limb_config]].concat());
    let mut input = limb.take_input();
    let mut sent = 0;
    let mut send = || {
        writeln!(input, "{}", frame(2500, sent)).unwrap();
        sent += 1;
        sent
    };
    wait_for("the head", || {
        thread::sleep(PERIOD);
        send();
        limb.reported.has("it has a subscriber") && head.running.out.has("peak")
    });
    relay.set(Link::Blocked);
    // 9 MB: more than systems keep for a connection.
    let rows = (0..900).map(|_| send()).last().unwrap();
    let has_newest = |lines: &Lines| lines.has(&format!("\"peak\":{}", peak(rows - 1)));
    wait_for("every percept while the network is blocked", || has_newest(&limb.out));
    assert_eq!(limb.out.all().len() as u64, rows, "the limb's own percepts are all there");
    assert!(limb.reported.has("frames come faster than they can be sent"), "{:?}", limb.reported.all());
    relay.set(Link::Up);
    wait_for("the newest frame", || has_newest(&head.running.out));
    drop(input);
    let (_, reported) = limb.end(&[0]);
    let counts =
        reported.iter().find_map(|line| Some(line.strip_suffix(" frames were left out")?.rsplit_once(": ")?.1));
    let (left_out, of) = counts.unwrap_or_else(|| panic!("{reported:?}")).split_once(" of ").unwrap();
    // It says with its code that frames are missing.
    let (_, _, accounts) = head.end(&[3]);
    let account = &accounts["sheet"];
    eprintln!("a network that blocks: {left_out} of {of} frames were left out; the head: {account}");
    // The end counts as one, and no other frame gets lost.
    assert_eq!(of.parse::<u64>().unwrap(), rows + 1);
    assert_eq!(number(&account["lost"]), left_out.parse::<u64>().unwrap());
    assert!(number(&account["lost"]) > 100, "{account}");
}

#[cfg(feature = "ros2")]
#[test]
fn a_node_that_stops_reading_holds_up_no_percept_and_what_it_did_not_get_is_counted() {
    use super::ros2_peer::{Peer, domain, ended, python, run};

    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let body = folder.path().join("sheet.glb").display().to_string();
    done(&["author", "--grid", "2x2", "--pitch", "5mm", "-o", &body]);
    let domain = domain();
    let touches = ("/somatic/touches", "visualization_msgs/msg/MarkerArray", "reliable:stamps");
    let mut peer = Peer::receive(&python, &domain, &[touches]);
    let arguments = ["run", "-q", "--body", &body, "--source", "-", "--outputs", "touches,peak", "--backend", "cpu"];
    let mut child = run(&domain, &[&arguments[..], &["--sink", "-", "--sink", "ros2"]].concat());
    let mut send = |number: u64| writeln!(child.child.stdin.as_mut().unwrap(), "{}", frame(4, number)).unwrap();
    // Of what is sent while the two find each other, some may be nobody's.
    let mut begun = 0;
    thread::scope(|scope| {
        let found = scope.spawn(|| peer.wait_for("received"));
        while !found.is_finished() {
            send(begun);
            begun += 1;
            thread::sleep(Duration::from_millis(20));
        }
    });
    thread::sleep(Duration::from_millis(500));
    peer.signal("STOP");
    // More than the 8,192 messages for which receipts may be missing.
    const COUNT: u64 = 12_000;
    let begin = Instant::now();
    for number in begun..COUNT {
        // 3,000 a second, which the thread that sends can take where nothing else keeps the cores busy.
        thread::sleep((Duration::from_micros(333) * (number - begun) as u32).saturating_sub(begin.elapsed()));
        send(number);
    }
    let (reported, said) = ended(child);
    let took = begin.elapsed();
    peer.signal("CONT");
    let peaks: Vec<u64> =
        super::frames(&reported).iter().map(|line| line["fields"][0]["peak"].as_f64().unwrap() as u64).collect();
    assert_eq!(peaks, (0..COUNT).map(peak).collect::<Vec<_>>(), "every percept, while nobody reads");
    let counted = |what: &str| -> u64 {
        let counts = said.lines().find_map(|line| Some(line.strip_suffix(what)?.rsplit_once(": ")?.1));
        let number = |counts: &str| counts.trim_start_matches("up to ").split(' ').next().unwrap().parse().unwrap();
        counts.map_or(0, number)
    };
    let not_sent = counted(" reliable messages were not sent, as a reader gave no receipts");
    let not_received = counted(" reliable messages may not have arrived, as a reader gave no receipts");
    let left_out = counted(" frames were left out");
    let received = peer.received();
    let since =
        received.iter().filter(|(_, _, stamp_ns)| stamp_ns.as_u64().unwrap() / 4_000_000 >= begun).count() as u64;
    eprintln!(
        "a node that stops reading: {took:?}; {begun} at first; then {since} received, {left_out} left out, {not_sent} not sent, up \
         to {not_received} not received"
    );
    assert!(not_sent + left_out > 0, "{said}");
    assert!(since + not_sent + left_out <= COUNT - begun, "{since}, {said}");
    // Every message is accounted for.
    assert!(since + not_received + not_sent + left_out >= COUNT - begun, "{since}, {said}");
}
