//! The page that shows a run in a browser, and its server.
//!
//! A [`PageScene`] is what is shown of a body and a plan; a [`Server`] serves it, on this machine alone unless
//! [`Listen`] says otherwise; a [`Publisher`] hands it what an engine computes, without ever waiting for a viewer. For a
//! recording a player reads [`Server::requests`] and answers through [`Replies`].

#![deny(missing_docs)]
#![warn(unreachable_pub)]

mod answers;
mod connection;
mod contacts;
mod current;
mod door;
mod encode;
mod exchange;
mod files;
mod guard;
mod http;
mod latency;
mod listen;
mod log;
mod mesh;
mod message;
mod poses;
mod publish;
mod readings;
mod scale;
mod scene;
mod sense_scale;
mod senses;
mod series;
mod serve;
mod server;
mod snapshot;
mod socket;
#[cfg(test)]
mod tests;
mod text;
mod token;
mod touches;
mod viewer;
mod wake;

pub use contacts::RecordingEvents;
pub use encode::{History, PeakMap};
pub use exchange::{Replies, ViewerId};
pub use listen::Listen;
pub use log::EventKind;
pub use message::Request;
pub use publish::{PageInput, Publisher};
pub use scene::{Mode, PageInfo, PageScene};
pub use series::Series;
pub use server::Server;
#[cfg(test)]
use somatic_bodies as bundled;
#[cfg(test)]
use somatic_skin::field;
use somatic_skin::{body, colours, error, signal};
