//! What the server's thread does: connections in, frames out.

use std::io::ErrorKind;
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{SyncSender, TrySendError};
use std::time::{Duration, Instant};

use super::answers::answer_without_player;
use super::connection::Connection;
use super::current::Current;
use super::door::Door;
use super::exchange::{Exchange, Payload, ViewerId, WAITING_ROWS};
use super::guard::is_token;
use super::http::Site;
use super::message::{Message, Request, parse};
use super::scene::PageScene;
use super::series::{Series, Trail};
use super::socket::{CloseReason, SharedBytes, Socket};
use super::text;
use super::viewer::Viewer;
use super::wake::Waits;
use crate::signal::BoardHealth;

/// The most connections.
const MAX_CONNECTIONS: usize = 16;
/// A viewer that has not drawn a frame for so long gives its place to a new one, if there is no other.
const GONE_TIME: Duration = Duration::from_secs(120);
/// Bytes of answers that wait for a viewer at most, beside the scene.
const MAX_WAITING_BYTES: usize = 4 << 20;
/// Events of a message at most.
const EVENTS_AT_ONCE: usize = 256;
/// Connections that are taken or refused before those that are there have their turn.
const ACCEPTED_AT_ONCE: usize = 64;
/// How often a connection that waits to be accepted is looked for.
const ACCEPT_PERIOD: Duration = Duration::from_millis(50);

/// The server's thread.
#[derive(Debug)]
pub(super) struct Serving {
    door: Door,
    site: Site,
    token: String,
    /// Names this start of the server.
    run: String,
    exchange: Arc<Exchange>,
    requests: SyncSender<(ViewerId, Request)>,
    connections: Vec<(ViewerId, Connection)>,
    /// A connection that there is no room for yet.
    next: Option<TcpStream>,
    /// Whether new connections are looked for later: the system has none to give.
    is_full: bool,
    next_id: u64,
    content: Content,
    /// Whether a connection has messages that have been read from the system already.
    has_more: bool,
}

/// What there is to send.
#[derive(Debug)]
struct Content {
    scene: PageScene,
    mesh: SharedBytes,
    current: Current,
    newest_event: u64,
    /// What any viewer plots, and its values.
    series: Arc<[Series]>,
    trail: Trail,
    boards: Vec<BoardHealth>,
    board_changes: u64,
    ended: Option<String>,
}

impl Serving {
    /// Serves `scene` to who has the first of `secrets`; the second names this run.
    pub(super) fn new(
        (door, site): (Door, Site),
        (token, run): (String, String),
        mut scene: PageScene,
        exchange: Arc<Exchange>,
        requests: SyncSender<(ViewerId, Request)>,
    ) -> Self {
        let content = Content {
            current: Current::new(&scene),
            mesh: std::mem::take(&mut scene.mesh).into(),
            scene,
            newest_event: 0,
            series: Arc::default(),
            trail: Trail::default(),
            boards: Vec::new(),
            board_changes: 0,
            ended: None,
        };
        let (connections, next) = (Vec::with_capacity(MAX_CONNECTIONS), None);
        Self {
            door,
            site,
            token,
            run,
            exchange,
            requests,
            connections,
            next,
            is_full: false,
            next_id: 0,
            content,
            has_more: false,
        }
    }

    /// Serves until it gets the signal to stop.
    pub(super) fn run(mut self, waits: &Waits) {
        Waits::lower_priority();
        loop {
            let stops = self.exchange.stops.load(Ordering::Relaxed);
            let now = Instant::now();
            self.accept(now);
            self.take_news();
            self.pass_on_replies();
            self.has_more = false;
            self.connections.iter_mut().for_each(|(_, connection)| connection.advance(&self.site, now));
            self.hand_on();
            for index in 0..self.connections.len() {
                self.receive(index, now);
                self.send(index, now);
            }
            self.remove_ended();
            if stops {
                break;
            }
            self.wait(waits, now);
        }
        for (_, connection) in &mut self.connections {
            connection.close(CloseReason::GoingAway, "the run has ended");
            connection.advance(&self.site, Instant::now());
        }
    }

    fn wait(&self, waits: &Waits, now: Instant) {
        let published = self.content.current.snapshot().published;
        let accepts = self.next.is_none() && !self.is_full;
        let listener = self.door.listener();
        let mut due = (listener.is_some() && !accepts).then_some(now + ACCEPT_PERIOD);
        for (_, connection) in &self.connections {
            due = [due, connection.due_at(), connection.taxel_due_at(published)].into_iter().flatten().min();
        }
        let most = if self.has_more { Some(Duration::ZERO) } else { due.map(|due| due.saturating_duration_since(now)) };
        let listener = listener.filter(|_| accepts);
        let sockets = self.connections.iter().filter_map(|(_, connection)| connection.interest());
        waits.wait(self.exchange.waker(), listener, sockets, most);
    }

    /// Takes new connections. Where there is no room, one that says nothing goes; where all are viewers, the new one.
    fn accept(&mut self, now: Instant) {
        self.is_full = false;
        while let Some(connection) = self.door.handed() {
            // One that finds no room is closed.
            if self.connections.len() < MAX_CONNECTIONS {
                self.next_id += 1;
                self.connections.push((ViewerId(self.next_id), connection));
            }
        }
        let Some(listener) = self.door.listener() else { return };
        for _ in 0..ACCEPTED_AT_ONCE {
            if self.next.is_none() {
                match listener.accept() {
                    Ok((stream, _)) => self.next = Some(stream),
                    Err(e) => {
                        self.is_full = e.kind() != ErrorKind::WouldBlock;
                        return;
                    }
                }
            }
            if self.connections.len() >= MAX_CONNECTIONS {
                if let Some(idle) = self.connections.iter().position(|(_, connection)| connection.is_idle(now)) {
                    self.connections.remove(idle);
                } else if let Some(gone) = self.gone(now) {
                    // There is room once its viewer has received that.
                    self.connections[gone].1.close(CloseReason::Overload, "nothing was drawn for two minutes");
                    return;
                } else if self.connections.iter().all(|(_, connection)| connection.seen().is_some()) {
                    self.next = None;
                    continue;
                } else {
                    return;
                }
            }
            if let Some(stream) = self.next.take() {
                self.next_id += 1;
                self.connections.push((ViewerId(self.next_id), Connection::new(stream, now)));
            }
        }
    }

    /// A viewer that has drawn nothing for so long that its computer may be gone.
    fn gone(&self, now: Instant) -> Option<usize> {
        let is_gone = |connection: &Connection| connection.owes_since().is_some_and(|since| now - since >= GONE_TIME);
        self.connections.iter().position(|(_, connection)| is_gone(connection))
    }

    /// Takes what the engine's thread has left.
    fn take_news(&mut self) {
        let content = &mut self.content;
        let mut shared = self.exchange.lock();
        if std::mem::take(&mut shared.is_new) {
            content.current.swap(&mut shared.snapshot);
        }
        content.newest_event = shared.log.newest();
        std::mem::swap(&mut content.trail, &mut shared.trail);
        if let Some(boards) = shared.boards.take() {
            content.boards = boards;
            content.board_changes += 1;
        }
        if let Some(reason) = shared.ended.take() {
            content.ended = Some(reason);
        }
        drop(shared);
        if !content.trail.is_empty() {
            for (_, viewer) in self.connections.iter_mut().filter_map(|(_, connection)| connection.viewer()) {
                viewer.take_values(&content.trail, &content.series);
            }
            content.trail.clear();
        }
    }

    fn pass_on_replies(&mut self) {
        let most = MAX_WAITING_BYTES + self.content.mesh.len();
        for reply in self.exchange.take_replies() {
            let to = self.connections.iter_mut().filter(|(id, _)| reply.to.is_none_or(|to| to == *id));
            for (_, connection) in to {
                let Some((socket, _)) = connection.viewer() else { continue };
                if socket.waiting_bytes() > most {
                    connection.close(CloseReason::Overload, "too much waits to be read");
                } else {
                    socket.push(reply.message.clone());
                }
            }
        }
    }

    /// Heeds what has come on a connection.
    fn receive(&mut self, index: usize, now: Instant) {
        let Self { connections, content, requests, exchange, token, run, .. } = self;
        let (id, connection) = &mut connections[index];
        let mut series_changed = false;
        self.has_more |= connection.receive(|connection, text| {
            let Some((_, viewer)) = connection.viewer() else {
                greet(connection, &text, token, run, content, exchange);
                if connection.seen().is_some() {
                    pass_on(connection, *id, Request::Joined, requests, exchange, content);
                }
                return;
            };
            match parse(&text, content.current.counts()) {
                Ok(Message::Drawn { seq }) => viewer.drawn(seq, now),
                Ok(Message::Columns(columns)) => viewer.set_columns(columns),
                Ok(Message::Series(series)) => {
                    viewer.set_series(series);
                    series_changed = true;
                }
                Ok(Message::Taxel(taxel)) => viewer.set_hovered(taxel),
                Ok(Message::Request(request)) => pass_on(connection, *id, request, requests, exchange, content),
                Ok(Message::Hello { .. }) => connection.close(CloseReason::Policy, "hello came twice"),
                Err(reason) => connection.close(CloseReason::Policy, &reason),
            }
        });
        if series_changed {
            self.follow_series();
        }
    }

    /// Sends a viewer what is due, if it has read what was sent before.
    fn send(&mut self, index: usize, now: Instant) {
        let Self { connections, content, exchange, .. } = self;
        let connection = &mut connections[index].1;
        connection.send();
        // All events of the log at most, and a frame.
        while let Some((socket, viewer)) = connection.viewer()
            && socket.is_idle()
        {
            content.push_due(socket, viewer, exchange, now);
            if socket.is_idle() {
                return;
            }
            connection.send();
        }
    }

    /// Hands what is of the second of two pages on to its server.
    fn hand_on(&mut self) {
        while let Some(index) = self.connections.iter().position(|(_, connection)| self.door.hands_on(connection)) {
            let (_, connection) = self.connections.remove(index);
            self.door.hand_on(connection);
        }
    }

    fn remove_ended(&mut self) {
        let has_player = self.exchange.has_player.load(Ordering::Relaxed);
        let mut left = false;
        self.connections.retain_mut(|(id, connection)| {
            if connection.has_left() {
                left = true;
                if has_player {
                    // A player that does not listen learns it from what it cannot send.
                    let _ = self.requests.try_send((*id, Request::Left));
                }
            }
            !connection.is_over()
        });
        self.exchange
            .set_viewers(self.connections.iter().filter(|(_, connection)| connection.seen().is_some()).count());
        if left {
            self.follow_series();
        }
    }

    /// Has the engine's thread note what any viewer plots.
    fn follow_series(&mut self) {
        let mut all: Vec<Series> = Vec::new();
        for viewer in self.connections.iter().filter_map(|(_, connection)| connection.seen()) {
            let new = viewer.series().iter().filter(|series| !all.contains(series)).copied().collect::<Vec<_>>();
            all.extend(new);
        }
        let content = &mut self.content;
        if *all != *content.series {
            content.series = all.into();
            let width = content.series.len();
            content.trail = Trail::new(width, WAITING_ROWS);
            let mut shared = self.exchange.lock();
            shared.series = Arc::clone(&content.series);
            shared.trail = Trail::new(width, WAITING_ROWS);
        }
    }
}

impl Content {
    /// Gives `socket` everything that its viewer is due.
    fn push_due(&mut self, socket: &mut Socket, viewer: &mut Viewer, exchange: &Exchange, now: Instant) {
        if viewer.seen_event != self.newest_event {
            let (lost, events) = exchange.lock().log.after(viewer.seen_event, EVENTS_AT_ONCE);
            viewer.seen_event = events.last().map_or(self.newest_event, |event| event.seq);
            socket.push(Payload::Text(text::events(lost, &events, &self.scene.names)));
        }
        if viewer.seen_boards != self.board_changes {
            viewer.seen_boards = self.board_changes;
            socket.push(Payload::Text(text::boards(&self.boards)));
        }
        let published = self.current.snapshot().published;
        if viewer.wants_frame(published) {
            self.current.read();
            if viewer.seen_scale != self.current.scale_changes() {
                viewer.seen_scale = self.current.scale_changes();
                socket.push(Payload::Text(text::scale(self.current.scale(), self.current.sense_scales())));
            }
            socket.push(Payload::Binary(viewer.frame(&self.current, self.newest_event)));
        }
        if published > 0
            && let Some(taxel) = viewer.due_taxel(published, now)
        {
            let reading = self.current.taxel(taxel);
            socket.push(Payload::Text(text::taxel(taxel, self.current.snapshot().t_s, &reading)));
        }
        if let Some(reason) = &self.ended
            && !viewer.seen_end
            && viewer.has(published)
        {
            viewer.seen_end = true;
            socket.push(Payload::Text(text::ended(reason)));
        }
    }
}

/// Lets a WebSocket in whose first message has the token.
fn greet(connection: &mut Connection, message: &str, token: &str, run: &str, content: &Content, exchange: &Exchange) {
    let after_event = match parse(message, &Default::default()) {
        Ok(Message::Hello { token: given, after_event }) if is_token(&given, token) => after_event,
        Ok(Message::Hello { .. }) => {
            return connection.close(CloseReason::Policy, "wrong token; open the address that the server has printed");
        }
        // The viewer gets the reason if its page is of another version.
        Err(reason) if reason.contains("version") => return connection.close(CloseReason::Policy, &reason),
        _ => return connection.close(CloseReason::Policy, "the first message is not a hello"),
    };
    let seen = after_event.unwrap_or_else(|| exchange.lock().log.forgotten());
    let mut viewer = Viewer::new(seen);
    viewer.seen_scale = content.current.scale_changes();
    connection.admit(viewer);
    if let Some((socket, _)) = connection.viewer() {
        socket.push(Payload::Text(content.scene.welcome(run, content.current.scale(), content.current.sense_scales())));
        socket.push_shared(&content.mesh);
    }
}

/// Passes a request on to the player, or answers it.
fn pass_on(
    connection: &mut Connection,
    id: ViewerId,
    request: Request,
    requests: &SyncSender<(ViewerId, Request)>,
    exchange: &Exchange,
    content: &Content,
) {
    let explains = matches!(request, Request::Explain { .. }) && exchange.has_explainer.load(Ordering::Relaxed);
    if explains || exchange.has_player.load(Ordering::Relaxed) {
        if let Err(TrySendError::Full(_)) = requests.try_send((id, request)) {
            connection.close(CloseReason::Overload, "too many requests");
        }
    } else if let Some((socket, _)) = connection.viewer() {
        if let Some(answer) = answer_without_player(&request, content.ended.is_some()) {
            socket.push(answer);
        }
        if socket.waiting_bytes() > MAX_WAITING_BYTES + content.mesh.len() {
            connection.close(CloseReason::Overload, "too much waits to be read");
        }
    }
}
