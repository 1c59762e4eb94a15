//! The server: one thread that waits for sockets and for the engine.

use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use super::door::Door;
use super::exchange::{Exchange, Replies, ViewerId};
use super::guard::Hosts;
use super::http::{PAIR_PATH, Site};
use super::listen::Listen;
use super::message::Request;
use super::publish::Publisher;
use super::scene::PageScene;
use super::serve::Serving;
use super::token::random_hex;
use super::wake::Waits;
use crate::error::{Error, Result};

/// Requests that wait for the player at most.
const MAX_REQUESTS: usize = 256;

/// A server of the page. It ends when it is dropped.
#[derive(Debug)]
pub struct Server {
    exchange: Arc<Exchange>,
    requests: Option<Receiver<(ViewerId, Request)>>,
    address: SocketAddr,
    token: String,
    listen: Listen,
    /// Of the page that people are told of.
    path: &'static str,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    /// Starts to serve `scene`; what there is to see comes from the publisher.
    ///
    /// # Errors
    /// The address is taken, or the system has no random numbers for a token; or places are not in the world
    /// ([`Scene::relative_to`](somatic_engine::scene::Scene::relative_to)).
    pub fn start(listen: &Listen, scene: PageScene) -> Result<(Self, Publisher)> {
        let site = Site { hosts: Hosts::new(listen.allow_hosts()), is_pair: false };
        let room = Room::new(scene)?;
        let (listener, address) = bound(listen)?;
        room.serve(Door::Network(listener), site, &Address { listen, bound: address, token: random_hex()?, path: "/" })
    }

    /// Starts to serve two scenes side by side, at one address and with one token: `/pair.html` has the pages of both in
    /// frames. The first of the servers listens for both, so it has to live as long as the second.
    ///
    /// # Errors
    /// As [`Server::start`].
    pub fn start_pair(listen: &Listen, [first, second]: [PageScene; 2]) -> Result<[(Self, Publisher); 2]> {
        let rooms = [Room::new(first)?, Room::new(second)?];
        let site = Site { hosts: Hosts::new(listen.allow_hosts()), is_pair: true };
        let (listener, address) = bound(listen)?;
        let doors = Door::pair(listener, Arc::clone(&rooms[1].exchange));
        let address = Address { listen, bound: address, token: random_hex()?, path: PAIR_PATH };
        let ([first, second], [door, inner]) = (rooms, doors);
        Ok([first.serve(door, site.clone(), &address)?, second.serve(inner, site, &address)?])
    }

    /// Where it listens.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The page's address, with the token that lets a browser in.
    #[must_use]
    pub fn url(&self) -> String {
        self.listen.url(self.address, self.path, &self.token)
    }

    /// What to tell people: the page's address, and a warning where other machines reach it; lines that end.
    #[must_use]
    pub fn announcement(&self) -> String {
        let mut text = format!("page at {}\n", self.url());
        if self.listen.is_open_to_others() {
            text += "somatic: other machines reach this page, and its token travels in clear text; an SSH tunnel to \
                     127.0.0.1 keeps it private\n";
        }
        text
    }

    /// What viewers ask for, in order, for a player to answer through [`Server::replies`]. Without a player the server
    /// answers that frames come as they come. A second call gives none.
    pub fn requests(&mut self) -> Option<Receiver<(ViewerId, Request)>> {
        let requests = self.requests.take();
        self.exchange.has_player.store(true, Ordering::Relaxed);
        requests
    }

    /// What percepts viewers of a live run ask to have explained, as [`Server::requests`]; the server answers all else.
    pub fn explanations(&mut self) -> Option<Receiver<(ViewerId, Request)>> {
        self.exchange.has_explainer.store(true, Ordering::Relaxed);
        self.requests.take()
    }

    /// Sends messages to viewers.
    #[must_use]
    pub fn replies(&self) -> Replies {
        Replies(Arc::clone(&self.exchange))
    }

    /// Number of viewers.
    #[must_use]
    pub fn viewers(&self) -> usize {
        self.exchange.viewers()
    }
}

/// Where a server is found.
struct Address<'a> {
    listen: &'a Listen,
    bound: SocketAddr,
    token: String,
    path: &'static str,
}

/// Listens, without waiting for who comes.
fn bound(listen: &Listen) -> Result<(TcpListener, SocketAddr)> {
    let listener = listen.bind()?;
    let ready = listener.set_nonblocking(true).and_then(|()| listener.local_addr());
    let address = ready.map_err(|e| Error::failed(format!("cannot listen: {e}")))?;
    Ok((listener, address))
}

/// A scene, and what its server shares with the engine's thread.
struct Room {
    scene: PageScene,
    exchange: Arc<Exchange>,
    waits: Waits,
}

impl Room {
    fn new(scene: PageScene) -> Result<Self> {
        if let Some(link) = scene.plan.relative_to() {
            return Err(Error::usage(format!(
                "a page shows the world, and `relative_to` puts places into `{link}`; leave one of them out"
            )));
        }
        let (waits, waker) = Waits::new()?;
        let exchange = Arc::new(Exchange::new(&scene.plan, waker));
        Ok(Self { scene, exchange, waits })
    }

    /// Serves it to who comes through `door`.
    fn serve(self, door: Door, site: Site, at: &Address<'_>) -> Result<(Server, Publisher)> {
        let Self { scene, exchange, waits } = self;
        let publisher = Publisher::new(Arc::clone(&exchange), &scene);
        let (sender, requests): (SyncSender<_>, _) = sync_channel(MAX_REQUESTS);
        let secrets = (at.token.clone(), random_hex()?);
        let serving = Serving::new((door, site), secrets, scene, Arc::clone(&exchange), sender);
        let thread = std::thread::Builder::new().name("page".to_owned()).spawn(move || serving.run(&waits));
        let thread = thread.map_err(|e| Error::failed(format!("cannot start a thread: {e}")))?;
        let server = Server {
            exchange,
            requests: Some(requests),
            address: at.bound,
            token: at.token.clone(),
            listen: at.listen.clone(),
            path: at.path,
            thread: Some(thread),
        };
        Ok((server, publisher))
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.exchange.stops.store(true, Ordering::Relaxed);
        self.exchange.waker().wake();
        if let Some(thread) = self.thread.take() {
            // It has said on standard error why it failed.
            let _ = thread.join();
        }
    }
}
