//! Where a server's connections come from.

use std::net::TcpListener;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use super::connection::Connection;
use super::exchange::Exchange;

/// Connections that wait for the second server at most.
const MAX_WAITING: usize = 16;

/// Where connections come from: of two servers the first listens for both.
#[derive(Debug)]
pub(super) enum Door {
    /// From the network.
    Network(TcpListener),
    /// From the network, and those of the second page go on to its server.
    Both(TcpListener, SyncSender<Connection>, Arc<Exchange>),
    /// From the first server.
    Handed(Receiver<Connection>),
}

impl Door {
    /// For two servers, the second of which has `exchange`.
    pub(super) fn pair(listener: TcpListener, exchange: Arc<Exchange>) -> [Self; 2] {
        let (sender, receiver) = sync_channel(MAX_WAITING);
        [Self::Both(listener, sender, exchange), Self::Handed(receiver)]
    }

    pub(super) fn listener(&self) -> Option<&TcpListener> {
        match self {
            Self::Network(listener) | Self::Both(listener, ..) => Some(listener),
            Self::Handed(_) => None,
        }
    }

    /// A connection that the first server has handed on.
    pub(super) fn handed(&self) -> Option<Connection> {
        if let Self::Handed(connections) = self { connections.try_recv().ok() } else { None }
    }

    /// Whether `connection` is to go on to the second server.
    pub(super) fn hands_on(&self, connection: &Connection) -> bool {
        matches!(self, Self::Both(..)) && connection.is_beside()
    }

    /// Hands `connection` on. One that finds no room is closed.
    pub(super) fn hand_on(&self, connection: Connection) {
        if let Self::Both(_, connections, exchange) = self
            && connections.try_send(connection).is_ok()
        {
            exchange.waker().wake();
        }
    }
}
