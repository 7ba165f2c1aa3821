//! The log over a WebSocket in the Foxglove protocol, which Foxglove, Lichtblick and
//! PlotJuggler read.
//!
//! Source: Foxglove, WebSocket protocol, version 1 (`ws-protocol`, `docs/spec.md`):
//! a `serverInfo` and an `advertise` object as text for a new client; then a binary message
//! for each subscription: 1, its number, the time in nanoseconds, the body. A channel's
//! number is that of its topic.

use std::collections::HashMap;
use std::io::{self, ErrorKind};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use serde_json::{Value, json};
use tungstenite::handshake::server::{ErrorResponse, Request, Response};
use tungstenite::http::header::{ORIGIN, SEC_WEBSOCKET_PROTOCOL};
use tungstenite::http::{HeaderValue, StatusCode};
use tungstenite::{Message, WebSocket};

use crate::record::Topic;

/// Names of the protocol that clients ask for.
const PROTOCOLS: [&str; 2] = ["foxglove.websocket.v1", "foxglove.sdk.v1"];
/// Longest queue of a client; if it is full, new messages are dropped.
const WAITING: usize = 4096;
/// Longest wait for a client's request between two messages to it.
const LISTEN: Duration = Duration::from_millis(5);
/// Longest wait for each part of a client's handshake, some hundred times what a network takes: so long
/// can silent clients keep others out.
const HANDSHAKE: Duration = Duration::from_secs(1);
/// Longest wait for a client to take a message.
const PATIENCE: Duration = Duration::from_secs(5);
/// Most connections at a time.
const MOST: usize = 16;
/// Pause after a connection that could not be accepted.
const AFTER_ERROR: Duration = Duration::from_millis(100);
/// Web viewers that may read the log, beside pages of this machine.
const VIEWERS: [&str; 3] = [
    "https://app.foxglove.dev",
    "https://studio.foxglove.dev",
    "https://lichtblick-suite.github.io",
];
/// First byte of a message of data.
const DATA: u8 = 1;

/// A message for the clients.
struct Published {
    topic: Topic,
    time_ns: u64,
    body: Vec<u8>,
}

/// A server that publishes to every client.
pub struct Server {
    address: SocketAddr,
    clients: Clients,
}

/// The clients that have shaken hands.
type Clients = Arc<Mutex<Vec<SyncSender<Arc<Published>>>>>;

impl Server {
    pub fn bind(address: &str) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        let address = listener.local_addr()?;
        let clients = Clients::default();
        let shared = Arc::clone(&clients);
        thread::spawn(move || accept(listener.incoming(), &shared));
        Ok(Self { address, clients })
    }

    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    #[cfg(test)]
    pub(crate) fn clients(&self) -> usize {
        lock(&self.clients).len()
    }

    /// Sends a message to every client that has subscribed to its topic. A slow client loses
    /// messages and does not delay the others.
    pub(crate) fn publish(&self, topic: Topic, time_ns: u64, body: Vec<u8>) {
        let message = Arc::new(Published { topic, time_ns, body });
        lock(&self.clients).retain(|client| {
            !matches!(client.try_send(Arc::clone(&message)), Err(TrySendError::Disconnected(_)))
        });
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Serves every connection in its own thread, [`MOST`] at a time; one that fails ends no other.
fn accept(incoming: impl Iterator<Item = io::Result<TcpStream>>, clients: &Clients) {
    let open = Arc::new(());
    for stream in incoming {
        match stream {
            Ok(stream) if Arc::strong_count(&open) <= MOST => {
                let (open, clients) = (Arc::clone(&open), Arc::clone(clients));
                thread::spawn(move || {
                    // A client that disconnects ends in an error.
                    let _ = serve(stream, &clients);
                    drop(open);
                });
            }
            Ok(_) => {}
            Err(_) => thread::sleep(AFTER_ERROR),
        }
    }
}

/// Serves a client until it disconnects.
fn serve(stream: TcpStream, clients: &Clients) -> tungstenite::Result<()> {
    stream.set_read_timeout(Some(HANDSHAKE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let Ok(mut socket) = tungstenite::accept_hdr(stream, agree) else { return Ok(()) };
    let (sender, messages) = sync_channel(WAITING);
    lock(clients).push(sender);
    greet(&mut socket)?;
    talk(&mut socket, &messages)
}

/// Whether a page of this origin may read the log: one of this machine or of a known viewer. A
/// program that is no web page has none, or one that no web page can have.
fn may_read(origin: &str) -> bool {
    let Some((scheme, rest)) = origin.split_once("://") else { return false };
    let host = rest.rsplit_once(':').filter(|(_, port)| port.parse::<u16>().is_ok());
    let host = host.map_or(rest, |(host, _)| host);
    !matches!(scheme, "http" | "https")
        || ["localhost", "127.0.0.1", "[::1]"].contains(&host)
        || VIEWERS.contains(&origin)
}

/// Accepts the first of the protocol's names that the client offers.
#[expect(clippy::result_large_err, reason = "the type of the callback is the library's")]
fn agree(request: &Request, mut response: Response) -> Result<Response, ErrorResponse> {
    let refused = |status: StatusCode, why: String| {
        let mut refused = ErrorResponse::new(Some(why));
        *refused.status_mut() = status;
        refused
    };
    if let Some(origin) = request.headers().get(ORIGIN)
        && !origin.to_str().is_ok_and(may_read)
    {
        let why = "this page may not read the log".to_owned();
        return Err(refused(StatusCode::FORBIDDEN, why));
    }
    let offered = request.headers().get_all(SEC_WEBSOCKET_PROTOCOL).iter();
    let offered: Vec<&str> = offered
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(','))
        .map(str::trim)
        .collect();
    let Some(name) = PROTOCOLS.into_iter().find(|name| offered.contains(name)) else {
        let why = format!("expected {}", PROTOCOLS.join(" or "));
        return Err(refused(StatusCode::BAD_REQUEST, why));
    };
    response.headers_mut().insert(SEC_WEBSOCKET_PROTOCOL, HeaderValue::from_static(name));
    Ok(response)
}

fn greet(socket: &mut WebSocket<TcpStream>) -> tungstenite::Result<()> {
    let info = json!({
        "op": "serverInfo",
        "name": concat!("interstage ", env!("CARGO_PKG_VERSION")),
        "capabilities": [],
    });
    let channels = Topic::LIVE.map(|topic| {
        let schema = topic.schema();
        json!({
            "id": topic as u32,
            "topic": topic.name(),
            "encoding": "json",
            "schemaName": schema["title"],
            "schema": schema.to_string(),
            "schemaEncoding": "jsonschema",
        })
    });
    let advertise = json!({ "op": "advertise", "channels": channels });
    socket.send(Message::text(info.to_string()))?;
    socket.send(Message::text(advertise.to_string()))
}

fn talk(
    socket: &mut WebSocket<TcpStream>,
    messages: &Receiver<Arc<Published>>,
) -> tungstenite::Result<()> {
    socket.get_ref().set_read_timeout(Some(LISTEN))?;
    // Subscription numbers by channel.
    let mut subscribed: HashMap<u32, Vec<u32>> = HashMap::new();
    loop {
        match socket.read() {
            Ok(Message::Text(text)) => listen(&text, &mut subscribed),
            Ok(Message::Close(_)) => return Ok(()),
            Ok(_) => {}
            Err(tungstenite::Error::Io(error))
                if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(error) => return Err(error),
        }
        for message in messages.try_iter() {
            for number in subscribed.get(&(message.topic as u32)).into_iter().flatten() {
                socket.write(Message::binary(data(*number, &message)))?;
            }
        }
        socket.flush()?;
    }
}

/// Takes a client's request; ignores what is none.
fn listen(text: &str, subscribed: &mut HashMap<u32, Vec<u32>>) {
    let Ok(request) = serde_json::from_str::<Value>(text) else { return };
    let number = |value: &Value| value.as_u64().and_then(|number| u32::try_from(number).ok());
    let list = |key: &str| request[key].as_array().into_iter().flatten();
    match request["op"].as_str() {
        Some("subscribe") => {
            for one in list("subscriptions") {
                if let (Some(id), Some(channel)) = (number(&one["id"]), number(&one["channelId"])) {
                    subscribed.entry(channel).or_default().push(id);
                }
            }
        }
        Some("unsubscribe") => {
            let gone: Vec<u32> = list("subscriptionIds").filter_map(number).collect();
            for ids in subscribed.values_mut() {
                ids.retain(|id| !gone.contains(id));
            }
        }
        _ => {}
    }
}

fn data(subscription: u32, message: &Published) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(13 + message.body.len());
    bytes.push(DATA);
    bytes.extend(subscription.to_le_bytes());
    bytes.extend(message.time_ns.to_le_bytes());
    bytes.extend(&message.body);
    bytes
}

#[cfg(test)]
mod tests {
    use tungstenite::client::IntoClientRequest;

    use super::*;

    type Client = WebSocket<TcpStream>;

    fn connect(server: &Server, protocol: &str) -> Option<Client> {
        page(server, protocol, None)
    }

    /// A client of a page of this origin; none if it is refused.
    fn page(server: &Server, protocol: &str, origin: Option<&'static str>) -> Option<Client> {
        let stream = TcpStream::connect(server.address()).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        let mut request = format!("ws://{}/", server.address()).into_client_request().unwrap();
        let value = HeaderValue::from_str(protocol).unwrap();
        request.headers_mut().insert(SEC_WEBSOCKET_PROTOCOL, value);
        let origin = origin.map(|origin| (ORIGIN, HeaderValue::from_static(origin)));
        request.headers_mut().extend(origin);
        match tungstenite::client(request, stream) {
            Ok((client, response)) => {
                let agreed = response.headers().get(SEC_WEBSOCKET_PROTOCOL).unwrap();
                assert!(protocol.contains(agreed.to_str().unwrap()));
                Some(client)
            }
            Err(tungstenite::HandshakeError::Failure(_)) => None,
            Err(tungstenite::HandshakeError::Interrupted(_)) => panic!("interrupted"),
        }
    }

    fn text(client: &mut Client) -> Value {
        let message = client.read().unwrap();
        serde_json::from_str(message.to_text().unwrap()).unwrap()
    }

    #[test]
    fn a_client_learns_the_channels_and_gets_what_it_subscribes_to() {
        let server = Server::bind("127.0.0.1:0").unwrap();
        let mut client = connect(&server, "other, foxglove.websocket.v1").unwrap();
        assert_eq!(text(&mut client)["op"], "serverInfo");
        let advertised = text(&mut client);
        let channels = advertised["channels"].as_array().unwrap();
        assert_eq!(channels.len(), 3);
        for channel in channels {
            let schema: Value = serde_json::from_str(channel["schema"].as_str().unwrap()).unwrap();
            assert_eq!(schema["type"], "object");
            assert_eq!(channel["encoding"], "json");
        }
        let id = &channels.iter().find(|c| c["topic"] == "/ledger").unwrap()["id"];
        let request = json!({
            "op": "subscribe",
            "subscriptions": [{ "id": 77, "channelId": id }],
        });
        client.send(Message::text(request.to_string())).unwrap();
        // Until the server has the request, no client gets the messages.
        let server = Arc::new(server);
        let publisher = Arc::clone(&server);
        let (stop, stopped) = sync_channel::<()>(1);
        let feeding = thread::spawn(move || {
            while stopped.try_recv().is_err() {
                publisher.publish(Topic::Tick, 1, b"{}".to_vec());
                publisher.publish(Topic::Ledger, 123_456_789, b"{\"index\":2}".to_vec());
                thread::sleep(Duration::from_millis(2));
            }
        });
        let message = client.read().unwrap().into_data();
        stop.send(()).unwrap();
        feeding.join().unwrap();
        assert_eq!(message[0], 1);
        assert_eq!(message[1..5], 77_u32.to_le_bytes());
        assert_eq!(message[5..13], 123_456_789_u64.to_le_bytes());
        assert_eq!(&message[13..], b"{\"index\":2}");
    }

    #[test]
    fn a_client_of_another_protocol_and_a_page_of_another_site_are_refused() {
        let server = Server::bind("127.0.0.1:0").unwrap();
        assert!(connect(&server, "chat").is_none());
        let from = |origin| page(&server, PROTOCOLS[0], Some(origin)).is_some();
        for origin in ["http://localhost:8080", "http://127.0.0.1", "file://", VIEWERS[0]] {
            assert!(from(origin), "{origin}");
        }
        for origin in ["https://example.com", "null", "http://localhost.example.com:80"] {
            assert!(!from(origin), "{origin}");
        }
    }

    #[test]
    fn connections_that_say_nothing_keep_others_out_no_longer_than_a_handshake_may_take() {
        let server = Server::bind("127.0.0.1:0").unwrap();
        let _silent: Vec<TcpStream> =
            (0..MOST).map(|_| TcpStream::connect(server.address()).unwrap()).collect();
        let mut late = TcpStream::connect(server.address()).unwrap();
        late.set_read_timeout(Some(HANDSHAKE)).unwrap();
        // It is closed at once.
        assert_eq!(io::Read::read(&mut late, &mut [0]).expect("closed"), 0);
        assert_eq!(server.clients(), 0);
        thread::sleep(2 * HANDSHAKE);
        assert!((0..50).any(|_| connect(&server, PROTOCOLS[0]).is_some()));
    }

    #[test]
    fn a_connection_that_fails_ends_no_other() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let server =
            Server { address: listener.local_addr().unwrap(), clients: Clients::default() };
        let clients = Arc::clone(&server.clients);
        thread::spawn(move || {
            let failed = std::iter::once(Err(ErrorKind::ConnectionAborted.into()));
            accept(failed.chain(listener.incoming()), &clients);
        });
        assert!(connect(&server, PROTOCOLS[0]).is_some());
    }

    #[test]
    fn subscriptions_end_and_nonsense_is_ignored() {
        let mut subscribed = HashMap::new();
        for text in [
            "nonsense",
            "{\"op\":\"subscribe\"}",
            "{\"op\":\"subscribe\",\"subscriptions\":[{\"id\":1,\"channelId\":1},{\"id\":-1}]}",
            "{\"op\":\"subscribe\",\"subscriptions\":[{\"id\":2,\"channelId\":1}]}",
            "{\"op\":\"unsubscribe\",\"subscriptionIds\":[1]}",
        ] {
            listen(text, &mut subscribed);
        }
        assert_eq!(subscribed, HashMap::from([(1, vec![2])]));
    }

    #[test]
    fn a_client_that_disconnects_is_forgotten() {
        let server = Server::bind("127.0.0.1:0").unwrap();
        let becomes = |count| {
            (0..500).any(|_| {
                server.publish(Topic::Log, 0, Vec::new());
                thread::sleep(Duration::from_millis(10));
                server.clients() == count
            })
        };
        let client = connect(&server, PROTOCOLS[1]).unwrap();
        assert!(becomes(1));
        drop(client);
        assert!(becomes(0));
    }
}
