//! Who may talk to the server: exact host names, the page's own origin, the token.
//!
//! Comparing an origin with the host alone does not stop DNS rebinding, as the attacker controls both; the list of exact
//! names does.

/// Names that always lead to this machine.
const OWN_NAMES: [&str; 3] = ["localhost", "127.0.0.1", "[::1]"];

/// The host names that requests may be for.
#[derive(Clone, Debug, Default)]
pub(super) struct Hosts {
    allowed: Vec<String>,
}

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    /// There is not exactly one Host.
    NoHost,
    /// The Host is none of the allowed names.
    Host,
    /// The Origin is absent, repeated, or not that of the page.
    Origin,
}

impl Hosts {
    /// This machine's own names, and `allowed`.
    pub(super) fn new(allowed: &[String]) -> Self {
        Self { allowed: allowed.iter().map(|name| name.to_ascii_lowercase()).collect() }
    }

    /// The one host among `hosts`, the values of a request's Host headers, if it is allowed at any port.
    pub(super) fn check<'a>(&self, hosts: &[&'a str]) -> Result<&'a str, Refusal> {
        let [host] = hosts else { return Err(Refusal::NoHost) };
        let name = without_port(host).ok_or(Refusal::Host)?.to_ascii_lowercase();
        let known = OWN_NAMES.iter().any(|own| *own == name) || self.allowed.contains(&name);
        if known { Ok(host) } else { Err(Refusal::Host) }
    }
}

/// Whether `name` can be given as an allowed host: a name or an address without a port.
pub(super) fn is_host_name(name: &str) -> bool {
    !name.is_empty() && name.bytes().all(|b| b.is_ascii_graphic() && !b"/@,*?#\\".contains(&b)) && {
        without_port(name) == Some(name)
    }
}

/// The name in `host`, without a port.
fn without_port(host: &str) -> Option<&str> {
    let end = if host.starts_with('[') { host.find(']')? + 1 } else { host.find(':').unwrap_or(host.len()) };
    let (name, rest) = host.split_at(end);
    let is_port = |port: &str| !port.is_empty() && port.len() <= 5 && port.bytes().all(|b| b.is_ascii_digit());
    (rest.is_empty() || rest.strip_prefix(':').is_some_and(is_port)).then_some(name)
}

/// Whether `origins`, the values of a request's Origin headers, is that of the page on `host`, and nothing else.
pub(super) fn check_origin(origins: &[&str], host: &str) -> Result<(), Refusal> {
    match origins {
        [origin] if origin.strip_prefix("http://") == Some(host) => Ok(()),
        _ => Err(Refusal::Origin),
    }
}

/// Whether the tokens are the same, in a time that does not depend on where they differ.
pub(super) fn is_token(given: &str, token: &str) -> bool {
    let differing = given.bytes().zip(token.bytes()).fold(0, |differing, (a, b)| differing | (a ^ b));
    given.len() == token.len() && std::hint::black_box(differing) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_exact_hosts_are_served() {
        let hosts = Hosts::new(&["robot.lan".to_owned()]);
        for host in ["localhost", "localhost:7879", "127.0.0.1:1", "[::1]", "[::1]:8080", "robot.lan:80", "LocalHost"] {
            assert_eq!(hosts.check(&[host]), Ok(host), "{host}");
        }
        for host in [
            "evil.example",
            "evil.example:7879",
            "localhost.evil.example",
            "localhost.",
            "127.0.0.2",
            "[::2]",
            "[::1",
            "::1",
            "localhost:",
            "localhost:80:80",
            "localhost:123456",
            "localhost:8a",
            "localhost@evil.example",
            " localhost",
            "",
        ] {
            assert_eq!(hosts.check(&[host]), Err(Refusal::Host), "{host}");
        }
        assert_eq!(Hosts::default().check(&["robot.lan"]), Err(Refusal::Host));
        assert_eq!(hosts.check(&[]), Err(Refusal::NoHost));
        assert_eq!(hosts.check(&["localhost", "localhost"]), Err(Refusal::NoHost));
    }

    #[test]
    fn the_origin_is_that_of_the_page() {
        assert_eq!(check_origin(&["http://localhost:7879"], "localhost:7879"), Ok(()));
        let refused: [&[&str]; 8] = [
            &[],
            &["null"],
            &["http://evil.example"],
            &["https://localhost:7879"],
            &["http://localhost:7880"],
            &["http://localhost"],
            &["localhost:7879"],
            &["http://localhost:7879", "http://localhost:7879"],
        ];
        for origins in refused {
            assert_eq!(check_origin(origins, "localhost:7879"), Err(Refusal::Origin), "{origins:?}");
        }
    }

    #[test]
    fn a_token_is_the_same_or_it_is_not() {
        assert!(is_token("0123abcd", "0123abcd"));
        for given in ["", "0123abc", "0123abce", "1123abcd", "0123abcd0", "0123ABCD"] {
            assert!(!is_token(given, "0123abcd"), "{given}");
        }
    }

    #[test]
    fn an_allowed_host_is_a_name_alone() {
        assert!(["robot.lan", "192.168.1.7", "[fe80::1]"].iter().all(|name| is_host_name(name)));
        assert!(["", "robot.lan:80", "http://robot.lan", "*", "a b", "fe80::1"].iter().all(|name| !is_host_name(name)));
    }
}
