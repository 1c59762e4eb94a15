//! Where the server listens.

use std::io::ErrorKind;
use std::net::{SocketAddr, TcpListener, ToSocketAddrs as _};

use super::guard::is_host_name;
use crate::error::{Error, Result};

/// The port, unless another one is asked for.
const PORT: u16 = 7879;
/// Ports that are tried after it.
const MORE_PORTS: u16 = 20;

/// Where a server listens, and for which host names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Listen {
    address: Option<SocketAddr>,
    allow_hosts: Vec<String>,
}

impl Listen {
    /// At `address`, a `HOST:PORT` where port 0 is any free one, or at 127.0.0.1:7879 or the next free port; for this
    /// machine's own names and `allow_hosts`.
    ///
    /// # Errors
    /// A usage error: the address is none, or other machines reach it and no host is allowed; a host is not a name.
    pub fn new(address: Option<&str>, allow_hosts: &[String]) -> Result<Self> {
        if let Some(name) = allow_hosts.iter().find(|name| !is_host_name(name)) {
            return Err(Error::usage(format!(
                "--allow-host {name}: give a name or an address without port or slashes"
            )));
        }
        let address = address.map(|text| {
            let found = text.to_socket_addrs().ok().and_then(|mut found| found.next());
            found.ok_or_else(|| {
                Error::usage(format!(
                    "`{text}` is not an address of this machine; give HOST:PORT, such as 127.0.0.1:7879"
                ))
            })
        });
        let listen = Self { address: address.transpose()?, allow_hosts: allow_hosts.to_vec() };
        if listen.is_open_to_others() && allow_hosts.is_empty() {
            return Err(Error::usage(
                "other machines reach this address; give the name that they use, with --allow-host NAME, or tunnel to \
                 127.0.0.1 through SSH",
            ));
        }
        Ok(listen)
    }

    /// The host names that are allowed beside this machine's own.
    pub(super) fn allow_hosts(&self) -> &[String] {
        &self.allow_hosts
    }

    /// Whether other machines reach it.
    #[must_use]
    pub fn is_open_to_others(&self) -> bool {
        self.address.is_some_and(|address| !address.ip().is_loopback())
    }

    /// Listens there.
    ///
    /// # Errors
    /// The port is taken, or may not be used.
    pub(super) fn bind(&self) -> Result<TcpListener> {
        let fail = |address: SocketAddr, e: &std::io::Error| {
            let hint = if e.kind() == ErrorKind::AddrInUse { "; port 0 uses any free one" } else { "" };
            Error::failed(format!("cannot listen: {e}{hint}")).at(format!("page {address}"))
        };
        if let Some(address) = self.address {
            return TcpListener::bind(address).map_err(|e| fail(address, &e));
        }
        let mut port = PORT;
        loop {
            let address = SocketAddr::from(([127, 0, 0, 1], port));
            match TcpListener::bind(address) {
                Err(e) if e.kind() == ErrorKind::AddrInUse && port < PORT + MORE_PORTS => port += 1,
                bound => return bound.map_err(|e| fail(address, &e)),
            }
        }
    }

    /// The address of the page at `path` of a server that listens at `bound`.
    pub(super) fn url(&self, bound: SocketAddr, path: &str, token: &str) -> String {
        let host = match self.allow_hosts.first().filter(|_| self.is_open_to_others()) {
            Some(name) => format!("{name}:{}", bound.port()),
            None => bound.to_string(),
        };
        format!("http://{host}{path}#token={token}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_machines_need_a_name() {
        let robot = ["robot.lan".to_owned()];
        assert!(Listen::new(Some("0.0.0.0:0"), &[]).unwrap_err().is_usage());
        let open = Listen::new(Some("0.0.0.0:0"), &robot).unwrap();
        assert!(open.is_open_to_others());
        assert_eq!(open.url(([0, 0, 0, 0], 80).into(), "/", "ab"), "http://robot.lan:80/#token=ab");
        for address in ["127.0.0.1:0", "[::1]:0", "localhost:0"] {
            assert!(!Listen::new(Some(address), &[]).unwrap().is_open_to_others());
        }
        for address in ["", "here", "127.0.0.1", "127.0.0.1:x", "127.0.0.1:70000"] {
            assert!(Listen::new(Some(address), &[]).unwrap_err().is_usage(), "{address}");
        }
        assert!(Listen::new(None, &["http://robot.lan".to_owned()]).unwrap_err().is_usage());
    }

    #[test]
    fn the_next_free_port_is_taken() {
        let listen = Listen::default();
        let (first, second) = (listen.bind().unwrap(), listen.bind().unwrap());
        let [first, second] = [first, second].map(|bound| bound.local_addr().unwrap());
        assert!(first.port() >= PORT && second.port() > first.port() && first.ip().is_loopback());
        assert_eq!(listen.url(first, "/", "ab"), format!("http://127.0.0.1:{}/#token=ab", first.port()));
        let taken = TcpListener::bind("127.0.0.1:0").unwrap();
        let text = taken.local_addr().unwrap().to_string();
        let error = Listen::new(Some(&text), &[]).unwrap().bind().unwrap_err().to_string();
        assert!(error.contains(&text) && error.contains("port 0"), "{error}");
    }
}
