//! A session of Zenoh. The only user of it.

use std::path::Path;

use zenoh::bytes::Encoding;
use zenoh::config::Config;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::{Session, Wait as _};

use crate::error::{Result, failed};

/// The default port on which a host listens for limbs on its own computer: Zenoh's.
const PORT: u16 = 7447;

/// Which side of the network a session is on, where no configuration says more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// It reads: it listens.
    Head,
    /// It sends: it connects, again and again until the head is there.
    Limb,
}

/// A session with the network.
pub struct Network(Session);

impl Network {
    /// Opens a session: as the file at `config` says, in Zenoh's own form, else on this computer alone.
    ///
    /// # Errors
    /// The file is not a configuration of Zenoh's; the session cannot be opened.
    pub fn open(config: Option<&Path>, side: Side) -> Result<Self> {
        let place = config.map_or_else(|| "zenoh".to_owned(), |path| path.display().to_string());
        let configured = match config {
            Some(path) => Config::from_file(path)
                .map_err(|e| failed!("not a configuration of Zenoh: {}", without_places(&e)).at(&place))?,
            None => loopback(side).map_err(|e| failed!("{e}").at(&place))?,
        };
        let session = zenoh::open(configured).wait().map_err(|e| {
            let hint = match (config, side) {
                (None, Side::Head) => format!(
                    "; does another program listen on port {PORT}? --zenoh-config FILE names another, or that program's router"
                ),
                _ => String::new(),
            };
            failed!("the session cannot be opened: {}{hint}", without_places(&e)).at(&place)
        })?;
        Ok(Self(session))
    }

    /// Has `take` called with each payload that is sent under `key`, on a thread of Zenoh's, until the session is dropped.
    ///
    /// # Errors
    /// The session has ended.
    pub(crate) fn subscribe(&self, key: &str, take: impl Fn(&[u8]) + Send + Sync + 'static) -> Result<()> {
        self.0
            .declare_subscriber(key.to_owned())
            .callback(move |sample| take(&sample.payload().to_bytes()))
            .background()
            .wait()
            .map_err(|e| failed!("{e}").at(format!("zenoh:{key}")))
    }

    /// Sends under `key`, from now until the publication is dropped, with the session.
    ///
    /// # Errors
    /// The session has ended.
    pub fn publish(self, key: &str, is_json: bool) -> Result<Publication> {
        let encoding = if is_json { Encoding::APPLICATION_JSON } else { Encoding::APPLICATION_OCTET_STREAM };
        let publisher = self
            .0
            .declare_publisher(key.to_owned())
            .encoding(encoding)
            // The thread that sends may wait; what comes meanwhile gives way to what is newer.
            .congestion_control(CongestionControl::Block)
            .express(true)
            .wait()
            .map_err(|e| failed!("{e}").at(format!("zenoh:{key}")))?;
        Ok(Publication { publisher, _session: self.0 })
    }
}

/// One key, and what is sent under it.
pub struct Publication {
    publisher: Publisher<'static>,
    _session: Session,
}

impl Publication {
    /// Sends `payload`. It may wait where the network is slow.
    ///
    /// # Errors
    /// The session has ended.
    pub fn put(&self, payload: &[u8]) -> Result<()> {
        self.publisher
            .put(payload)
            .wait()
            .map_err(|e| failed!("{e}").at(format!("zenoh:{}", self.publisher.key_expr())))
    }

    /// Whether anybody reads it, as far as is known.
    pub fn is_read(&self) -> bool {
        self.publisher.matching_status().wait().is_ok_and(|status| status.matching())
    }
}

/// An error's text without where in Zenoh's sources it came from.
fn without_places(error: &zenoh::Error) -> String {
    let text = error.to_string();
    text.split(" at /").next().unwrap_or(&text).replace('[', "")
}

/// Peers on this computer alone, which look for nobody.
fn loopback(side: Side) -> zenoh::Result<Config> {
    let mut config = Config::default();
    let here = format!("[\"tcp/127.0.0.1:{PORT}\"]");
    let (listen, connect) = match side {
        Side::Head => (here.as_str(), "[]"),
        Side::Limb => ("[]", here.as_str()),
    };
    for (key, value) in [
        ("mode", "\"peer\""),
        ("listen/endpoints", listen),
        ("connect/endpoints", connect),
        ("scouting/multicast/enabled", "false"),
        ("scouting/gossip/enabled", "false"),
    ] {
        config.insert_json5(key, value)?;
    }
    Ok(config)
}
