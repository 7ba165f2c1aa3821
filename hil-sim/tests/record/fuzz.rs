//! Damaged inputs of the host tools: the tools refuse them and never panic. `FUZZ_SECONDS` is
//! the time for each target.

#[path = "../../../tests/common/mutate.rs"]
mod mutate;

use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use hil_sim::live::Server;
use hil_sim::params::{Held, set_of};
use hil_sim::record::Run;
use hil_sim::replay::replay;
use hil_sim::scenario::Scenario;
use interstage::rig::Rig;

use super::logs::{data, frames};
use mutate::{Chance, fuzz, mutant};

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn scenario_files() {
    let corpus = [
        Scenario::default().to_toml().into_bytes(),
        Scenario::named("fe").expect("a preset").to_toml().into_bytes(),
        b"preset = \"fe\"\n[tread]\ntau_s = 0.2\n[plant]\nmu = 0.9\n".to_vec(),
        // Refused, which is fine.
        b"[run]\nseed = 3\nanomalies = [\"late 1 2.5\"]\n".to_vec(),
    ];
    fuzz("scenario files", &corpus, 1500, 4.0, |bytes| {
        let _ = Scenario::parse("fuzz.toml", &text(bytes), &[]);
    });
}

#[test]
fn overrides() {
    let keys: Vec<Vec<u8>> = Scenario::default()
        .keys()
        .iter()
        .map(|info| format!("{}={}", info.key, info.value).into_bytes())
        .collect();
    fuzz("--set", &keys, 3000, 3.0, |bytes| {
        let _ = Scenario::default().with(&[text(bytes)]);
    });
}

/// The beginning of a fixture's frames as on the channel.
fn beginning(name: &str) -> Vec<u8> {
    frames(&data(name)).concat()[..8000].to_vec()
}

/// Reads a file of these bytes, which may be refused.
fn read(bytes: &[u8]) {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("log");
    fs::write(&path, bytes).expect("written");
    if let Ok(run) = Run::read(&path) {
        let _ = run.is_complete();
    }
}

#[test]
fn logs() {
    let streams = ["deploy.mcap", "retract.mcap"].map(beginning);
    fuzz("streams", &streams, 2000, 2.0, read);
    let row = Run::of_stream(&streams[0]).rows.first().cloned().expect("a row");
    let mut csv = csv::Writer::from_writer(Vec::new());
    for _ in 0..20 {
        csv.serialize(row).expect("a row");
    }
    fuzz("CSV files", &[csv.into_inner().expect("flushed")], 2000, 2.0, read);
}

#[test]
fn mcap_files() {
    fuzz("MCAP files", &[fs::read(data("deploy.mcap")).expect("a fixture")], 300, 4.0, read);
}

#[test]
fn replays_of_damaged_streams() {
    let streams = [beginning("deploy.mcap")];
    let rig = Rig::prototype();
    fuzz("replay", &streams, 200, 3.0, |bytes| {
        let run = Run::of_stream(bytes);
        if !run.rows.is_empty() {
            let _ = replay(&run, &rig);
        }
    });
}

#[test]
fn parameter_files() {
    let rig = Rig::prototype();
    let corpus = [set_of("fuzz", &rig).expect("a sound rig")];
    fuzz("parameter files", &corpus, 3000, 2.0, |bytes| {
        let _ = Held::of(bytes, "fuzz".to_owned());
    });
}

#[test]
fn clients_of_the_live_view() {
    // A panic of the server's threads shows only in a hook; those of tests have names.
    static PANICS: AtomicUsize = AtomicUsize::new(0);
    let before = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        let ours = usize::from(std::thread::current().name().is_none());
        PANICS.fetch_add(ours, Ordering::Relaxed);
        before(info);
    }));
    let server = Server::bind("127.0.0.1:0").expect("a port");
    let request = b"GET / HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
        Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\
        Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n"
        .to_vec();
    // A masked text frame: {"op":"subscribe","subscriptions":[{"id":1,"channelId":1}]}
    let subscribe = br#"{"op":"subscribe","subscriptions":[{"id":1,"channelId":1}]}"#.to_vec();
    let framed = |text: &[u8]| {
        let mut frame = vec![0x81, 0x80 | text.len().min(125) as u8, 0, 0, 0, 0];
        frame.extend(&text[..text.len().min(125)]);
        frame
    };
    let mut chance = Chance::new(4);
    let talk = |first: &[u8], then: &[u8]| {
        let mut client = TcpStream::connect(server.address()).expect("it listens");
        client.set_read_timeout(Some(Duration::from_millis(20))).expect("set");
        // It may hang up at any time.
        let _ = client.write_all(first).and_then(|()| client.write_all(then));
        let _ = client.read(&mut [0; 2048]);
    };
    fuzz("live view, handshake", std::slice::from_ref(&request), 60, 2.0, |bytes| talk(bytes, &[]));
    fuzz("live view, messages", std::slice::from_ref(&subscribe), 60, 3.0, |bytes| {
        talk(&request, &framed(bytes));
        talk(&request, &mutant(&[framed(bytes)], &mut chance));
    });
    assert_eq!(PANICS.load(Ordering::Relaxed), 0);
    // And it still serves.
    let mut client = TcpStream::connect(server.address()).expect("it listens");
    client.write_all(&request).expect("it takes");
    let mut answer = [0; 12];
    client.set_read_timeout(Some(Duration::from_secs(5))).expect("set");
    client.read_exact(&mut answer).expect("it answers");
    assert_eq!(&answer, b"HTTP/1.1 101");
}
