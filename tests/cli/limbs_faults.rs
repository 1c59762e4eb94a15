//! What goes wrong between limbs and their head: bad links, links that are down, limbs that die, clocks that run apart, routers
//! that start again. Short for every day; `tests/long/limbs` runs it at full length and prints what was measured.

use std::collections::BTreeMap;
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;

use super::limbs_network::{
    Head, LIMBS, Limb, PERIOD, Place, compared, free_port, limbs_are_read, number, play, undistributed, wait_for,
};
use super::relay::{Link, Relay};
use somatic_testing::skip;

const KEYS: [&str; 4] = ["thumb", "index", "middle", "ring"];

/// Whether tests take their time.
fn is_long() -> bool {
    std::env::var_os("SOMATIC_LONG").is_some()
}

/// Frames in this many seconds, or fewer if there is no time.
fn frames_of(long_s: u64, short_s: u64) -> u64 {
    (if is_long() { long_s } else { short_s }) * 50
}

/// The delay of a bad network, and how much of it is chance.
const DELAY: Duration = Duration::from_millis(20);
const JITTER: Duration = Duration::from_millis(5);

/// What became of the rows of a limb that were sent from the first that the head had on: each is either in the percepts, or
/// lost, or a later one took its place before there was a frame of the skin.
fn account_for(key: &str, account: &Value, rows: u64, seen: &super::limbs_network::Seen) {
    let of = |what: &str| number(&account[what]);
    assert_eq!(of("sent"), of("delivered") + of("lost"));
    let missing = rows - seen.rows.first().unwrap() - seen.rows.len() as u64;
    let reported = of("lost") + of("replaced") + of("dropped");
    // Where the head's first frame of a limb was replaced, its row is before all that were seen; the last may still wait for
    // a frame of the skin at the end.
    assert!(
        (missing.saturating_sub(1)..=missing + 1).contains(&reported),
        "{key}: {missing} rows are missing: {account}"
    );
    eprintln!(
        "{key:6} {} sent, {} delivered, {} lost, {} replaced",
        of("sent"),
        of("delivered"),
        of("lost"),
        of("replaced")
    );
}

/// The `share` quantile of how long it took from writing a limb's frame until its percepts were read, ms.
fn latencies_ms(
    lines: &[(Instant, String)],
    field: &str,
    written: &[Instant],
    all: &BTreeMap<String, u64>,
) -> Vec<f64> {
    let mut first = BTreeMap::new();
    for (at, line) in lines {
        let line: Value = serde_json::from_str(line).unwrap();
        for percept in line["fields"].as_array().unwrap().iter().filter(|own| own["field"] == field) {
            if let Some(row) = all.get(&percept.to_string()) {
                first.entry(*row).or_insert(*at);
            }
        }
    }
    let mut took: Vec<f64> = first
        .iter()
        .map(|(row, at)| at.saturating_duration_since(written[*row as usize]).as_secs_f64() * 1e3)
        .collect();
    took.sort_by(f64::total_cmp);
    took
}

fn quantile(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}

/// What happens between the limbs and the head.
struct Story<'a> {
    what: &'a str,
    limbs: Vec<Limb>,
    head: Head,
    place: &'a Place,
}

impl Story<'_> {
    /// Plays for some time, goes through `event`, plays on; then all is accounted for. The limb at index `concerned` must have
    /// been stale, and alone have lost frames.
    fn tell(mut self, concerned: usize, before: u64, during: u64, after: u64, mut event: impl FnMut(bool)) {
        let Self { head, limbs, .. } = &mut self;
        let row = play(limbs, 0, |_| limbs_are_read(head));
        let row = play(limbs, row, |now| now == row + before);
        event(true);
        let row = play(limbs, row, |now| now == row + during);
        event(false);
        let back = format!("zenoh:{}: the limb sends again", KEYS[concerned]);
        let row = play(limbs, row, |_| head.running.reported.has(&back));
        let rows = play(limbs, row, |now| now == row + after);
        let written: Vec<Vec<Instant>> = limbs.iter().map(|limb| limb.written.clone()).collect();
        self.limbs.into_iter().for_each(|limb| drop(limb.end()));
        let reported = &self.head.running.reported;
        wait_for("the end", || KEYS.iter().all(|key| reported.has(&format!("zenoh:{key}: the limb has ended"))));
        let stamped = self.head.running.out.clone();
        let (lines, _, accounts) = self.head.end(&[0, 3]);
        let stamped = stamped.0.lock().unwrap();
        eprintln!("{}:", self.what);
        for (index, (field, key)) in LIMBS.iter().zip(KEYS).enumerate() {
            let all = undistributed(self.place, field, rows);
            let seen = compared(&lines, field, &all);
            account_for(key, &accounts[key], rows, &seen);
            if index == concerned {
                assert!(seen.stale > 0 && number(&accounts[key]["lost"]) > 0, "{seen:?}");
            } else {
                assert_eq!(number(&accounts[key]["lost"]), 0);
            }
            let took = latencies_ms(&stamped, field, &written[index], &all);
            eprintln!("{key:6} p50 {:.1} ms, p99 {:.1} ms", quantile(&took, 0.5), quantile(&took, 0.99));
        }
    }
}

/// Four limbs behind a link of their own each, and their head.
fn behind_relays(place: &Place) -> (Vec<Relay>, Vec<Limb>, Head) {
    let port = free_port();
    let head_config = place.config("head.json5", Some(port), None);
    let head = Head::start(place, &KEYS, &head_config, &["--live-rate", "0"]);
    let relay = || Relay::start("127.0.0.1", format!("127.0.0.1:{port}"), DELAY, JITTER).unwrap();
    let relays: Vec<Relay> = KEYS.iter().map(|_| relay()).collect();
    let limb = |(index, relay): (usize, &Relay)| {
        let config = place.config(&format!("limb-{index}.json5"), None, Some(relay.port));
        Limb::start(LIMBS[index], KEYS[index], &config)
    };
    let limbs = relays.iter().enumerate().map(limb).collect();
    (relays, limbs, head)
}

#[test]
fn a_link_that_is_cut_loses_frames_of_its_limb_alone() {
    let place = Place::new();
    let (relays, limbs, head) = behind_relays(&place);
    let story = Story { what: "a link cut", limbs, head, place: &place };
    story.tell(2, frames_of(10, 1), frames_of(5, 2), frames_of(10, 1), |begins| {
        relays[2].set(if begins { Link::Cut } else { Link::Up });
    });
}

#[test]
fn a_link_that_stalls_delivers_late_what_still_waits() {
    let place = Place::new();
    let (relays, limbs, head) = behind_relays(&place);
    let mut limbs = limbs;
    let row = play(&mut limbs, 0, |_| limbs_are_read(&head));
    let row = play(&mut limbs, row, |now| now == row + 50);
    relays[1].set(Link::Stalled);
    let row = play(&mut limbs, row, |now| now == row + frames_of(5, 2));
    relays[1].set(Link::Up);
    let rows = play(&mut limbs, row, |now| now == row + 50);
    limbs.into_iter().for_each(|limb| drop(limb.end()));
    wait_for("the end", || {
        KEYS.iter().all(|key| head.running.reported.has(&format!("zenoh:{key}: the limb has ended")))
    });
    let (lines, _, accounts) = head.end(&[0]);
    eprintln!("a link stalled:");
    for (field, key) in LIMBS.iter().zip(KEYS) {
        let seen = compared(&lines, field, &undistributed(&place, field, rows));
        account_for(key, &accounts[key], rows, &seen);
        assert_eq!(number(&accounts[key]["lost"]), 0, "TCP delivers it all");
        assert_eq!(seen.stale > 0, key == "index", "{seen:?}");
    }
    // A late frame is dated back to when it was read, and is no news then.
    assert!(number(&accounts["index"]["replaced"]) > 50, "{accounts:?}");
}

#[test]
fn a_limb_that_dies_is_stale_and_comes_back_under_its_key() {
    let place = Place::new();
    let (relays, mut limbs, head) = behind_relays(&place);
    let row = play(&mut limbs, 0, |_| limbs_are_read(&head));
    let row = play(&mut limbs, row, |now| now == row + 50);
    // As by kill -9.
    drop(limbs.pop());
    let died = row;
    let row = play(&mut limbs, row, |now| now == row + frames_of(5, 2));
    let config = place.config("again.json5", None, Some(relays[3].port));
    limbs.push(Limb::start(LIMBS[3], KEYS[3], &config));
    let back = row;
    let row = play(&mut limbs, row, |_| head.running.reported.has("zenoh:ring: the limb has started again"));
    let rows = play(&mut limbs, row, |now| now == row + 50);
    limbs.into_iter().for_each(|limb| drop(limb.end()));
    wait_for("the end", || {
        KEYS.iter().all(|key| head.running.reported.has(&format!("zenoh:{key}: the limb has ended")))
    });
    // The second start may have been heard from its first frame on.
    let (lines, _, accounts) = head.end(&[0, 3]);
    eprintln!("a limb killed and started again:");
    for (field, key) in LIMBS[..3].iter().zip(KEYS) {
        let seen = compared(&lines, field, &undistributed(&place, field, rows));
        account_for(key, &accounts[key], rows, &seen);
        assert_eq!((number(&accounts[key]["lost"]), seen.stale), (0, 0));
    }
    let seen = compared(&lines, LIMBS[3], &undistributed(&place, LIMBS[3], rows));
    let account = &accounts["ring"];
    eprintln!("ring   {account}");
    assert!(seen.stale > 0 && number(&account["restarts"]) == 1, "{account}");
    // Of its second life all are known: those that nobody heard yet are lost. Of its first one, those on their way as it died
    // are not.
    let first = seen.rows.range(..died).count() as u64;
    let second = rows - back;
    let sent = number(&account["sent"]);
    let replaced = number(&account["replaced"]);
    assert!((first + second..=first + second + replaced + 5).contains(&sent), "{first} and {second}: {account}");
    assert!(died - 1 - seen.rows.range(..died).last().unwrap() <= 5, "{seen:?}");
}

#[test]
fn a_clock_that_runs_fast_is_followed() {
    let place = Place::new();
    let (_relays, mut limbs, head) = behind_relays(&place);
    let begin = Instant::now();
    let mut row = 0;
    let mut rows = u64::MAX;
    while row < rows {
        thread::sleep((begin + PERIOD * row as u32).saturating_duration_since(Instant::now()));
        let t_s = begin.elapsed().as_secs_f64();
        for (index, limb) in limbs.iter_mut().enumerate() {
            limb.send_at(row, 100.0 * index as f64 + t_s * if index == 2 { 1.0 + 200e-6 } else { 1.0 });
        }
        if rows == u64::MAX && limbs_are_read(&head) {
            rows = row + frames_of(70, 33);
        }
        row += 1;
    }
    limbs.into_iter().for_each(|limb| drop(limb.end()));
    wait_for("the end", || {
        KEYS.iter().all(|key| head.running.reported.has(&format!("zenoh:{key}: the limb has ended")))
    });
    let (lines, _, accounts) = head.end(&[0]);
    for (index, (field, key)) in LIMBS.iter().zip(KEYS).enumerate() {
        let account = &accounts[key];
        let seen = compared(&lines, field, &undistributed(&place, field, rows));
        account_for(key, account, rows, &seen);
        let drift_ppm = account["drift_ppm"].as_f64().unwrap();
        eprintln!("{key:6} clock {drift_ppm:+.0} ppm");
        // Half seconds have 25 frames, whose least delay varies by a few tenths of a millisecond over half a minute; the
        // scheduler of a busy machine adds to that.
        let wanted = if index == 2 { 200.0 } else { 0.0 };
        assert!((drift_ppm - wanted).abs() < 80.0, "{key}: {drift_ppm}");
    }
}

#[test]
fn a_router_that_starts_again_loses_frames_that_are_counted() {
    let place = Place::new();
    let port = free_port();
    let router = || {
        let config = place.config_of("router.json5", "router", Some(format!("127.0.0.1:{port}")), None);
        let open = || zenoh::Wait::wait(zenoh::open(zenoh::Config::from_file(&config).unwrap()));
        let begin = Instant::now();
        loop {
            match open() {
                Ok(session) => return session,
                Err(error) => assert!(begin.elapsed() < Duration::from_secs(10), "{error}"),
            }
            thread::sleep(Duration::from_millis(100));
        }
    };
    let mut running = Some(router());
    let config = place.config_of("client.json5", "client", None, Some(format!("127.0.0.1:{port}")));
    let head = Head::start(&place, &KEYS, &config, &["--live-rate", "0"]);
    let mut limbs: Vec<Limb> = LIMBS.iter().zip(KEYS).map(|(field, key)| Limb::start(field, key, &config)).collect();
    let row = play(&mut limbs, 0, |_| limbs_are_read(&head));
    let row = play(&mut limbs, row, |now| now == row + 50);
    let session = running.take().unwrap();
    zenoh::Wait::wait(session.close()).unwrap();
    let row = play(&mut limbs, row, |now| now == row + frames_of(5, 2));
    running = Some(router());
    let row = play(&mut limbs, row, |_| {
        KEYS.iter().all(|key| head.running.reported.has(&format!("zenoh:{key}: the limb sends again")))
    });
    let rows = play(&mut limbs, row, |now| now == row + 50);
    limbs.into_iter().for_each(|limb| drop(limb.end()));
    wait_for("the end", || {
        KEYS.iter().all(|key| head.running.reported.has(&format!("zenoh:{key}: the limb has ended")))
    });
    let (lines, _, accounts) = head.end(&[3]);
    eprintln!("a router started again:");
    for (field, key) in LIMBS.iter().zip(KEYS) {
        let seen = compared(&lines, field, &undistributed(&place, field, rows));
        account_for(key, &accounts[key], rows, &seen);
        assert!(seen.stale > 0 && number(&accounts[key]["lost"]) > 50, "{key}: {seen:?}");
    }
    drop(running);
}

/// A network namespace with a link of its own to this one, as another computer has.
struct Space {
    name: String,
    link: String,
    here: String,
}

fn ip(arguments: &str) -> Result<(), String> {
    let output = Command::new("ip").args(arguments.split(' ')).output().map_err(|e| format!("ip: {e}"))?;
    let reported = String::from_utf8_lossy(&output.stderr).into_owned();
    if output.status.success() { Ok(()) } else { Err(format!("ip {arguments}: {reported}")) }
}

impl Space {
    fn new(number: u32) -> Result<Self, String> {
        let id = std::process::id() % 10_000;
        let (name, link) = (format!("somatic{id}-{number}"), format!("sm{id}-{number}"));
        ip(&format!("netns add {name}"))?;
        let subnet = format!("10.{}.{}", 100 + id % 100, number);
        let space = Self { name, link, here: format!("{subnet}.1") };
        let Self { name, link, here } = &space;
        ip(&format!("link add {link} type veth peer name {link}p"))?;
        ip(&format!("link set {link}p netns {name}"))?;
        ip(&format!("addr add {here}/24 dev {link}"))?;
        ip(&format!("link set {link} up"))?;
        ip(&format!("-n {name} addr add {subnet}.2/24 dev {link}p"))?;
        ip(&format!("-n {name} link set {link}p up"))?;
        Ok(space)
    }
}

impl Drop for Space {
    fn drop(&mut self) {
        let _ = ip(&format!("netns del {}", self.name));
        let _ = ip(&format!("link del {}", self.link));
    }
}

#[test]
fn limbs_in_network_namespaces_behind_a_link_that_goes_down() {
    let spaces = match (1..=4).map(Space::new).collect::<Result<Vec<Space>, String>>() {
        Ok(spaces) => spaces,
        Err(why) => return skip("NETNS", format!("no network namespaces can be made: {why}")),
    };
    let place = Place::new();
    let port = free_port();
    let head_config = place.config("head.json5", Some(port), None);
    let head = Head::start(&place, &KEYS, &head_config, &["--live-rate", "0"]);
    let mut relays = Vec::new();
    let mut limbs = Vec::new();
    for (index, space) in spaces.iter().enumerate() {
        let relay = Relay::start(&space.here, format!("127.0.0.1:{port}"), DELAY, JITTER).unwrap();
        let connect = Some(format!("{}:{}", space.here, relay.port));
        let config = place.config_of(&format!("limb-{index}.json5"), "peer", None, connect);
        limbs.push(Limb::start_in(Some(&space.name), LIMBS[index], KEYS[index], &config));
        relays.push(relay);
    }
    let down = spaces[0].link.clone();
    let mut rest = limbs;
    let row = play(&mut rest, 0, |_| limbs_are_read(&head));
    let row = play(&mut rest, row, |now| now == row + frames_of(10, 1));
    ip(&format!("link set {down} down")).unwrap();
    let row = play(&mut rest, row, |now| now == row + frames_of(5, 2));
    ip(&format!("link set {down} up")).unwrap();
    let row = play(&mut rest, row, |_| head.running.reported.has("zenoh:thumb: the limb sends again"));
    let rows = play(&mut rest, row, |now| now == row + 100);
    rest.into_iter().for_each(|limb| drop(limb.end()));
    wait_for("the end", || {
        KEYS.iter().all(|key| head.running.reported.has(&format!("zenoh:{key}: the limb has ended")))
    });
    // What TCP still had may have come after all.
    let (lines, _, accounts) = head.end(&[0, 3]);
    eprintln!("a link in a namespace down:");
    for (field, key) in LIMBS.iter().zip(KEYS) {
        let seen = compared(&lines, field, &undistributed(&place, field, rows));
        account_for(key, &accounts[key], rows, &seen);
        assert_eq!(seen.stale > 0, key == "thumb", "{seen:?}");
    }
}
