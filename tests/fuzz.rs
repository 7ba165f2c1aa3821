//! Damaged input of every kind from outside the firmware: its readers refuse it
//! and never panic. `FUZZ_SECONDS` gives each target that long instead.

use interstage::log::frame::{Body, Frame, FrameBuffer, Head, Kind, LONGEST};
use interstage::log::{Identity, crc32};
use interstage::model::Planner;
use interstage::params::link::{FrameReader, ToBoard, ToHost, frame};
use interstage::params::service::{Piece, Request, Response};
use interstage::params::slots::{SLOT_BYTES, slot_image, stored};
use interstage::params::{ParameterSet, compile};
use interstage::rig::Rig;
use interstage::supervise::{Command, Mode};
use interstage::tick::{Controller, Entry, Event};

use crate::common::FixedFlash;
use crate::common::mutate::fuzz;

fn set(rig: &Rig) -> Vec<u8> {
    compile("fuzz", rig).expect("a sound rig").to_vec()
}

fn postcard<T: serde::Serialize>(value: &T) -> Vec<u8> {
    let mut room = [0; 512];
    postcard::to_slice(value, &mut room).expect("fits").to_vec()
}

/// With the check that fits, so that what is behind it is reached.
fn signed(bytes: &[u8]) -> Vec<u8> {
    [bytes, &crc32(bytes).to_le_bytes()].concat()
}

fn open_set(bytes: &[u8]) {
    if let Ok(set) = ParameterSet::open_any(bytes) {
        let _ = set.rig();
        let _ = set.header().name.as_str();
    }
    let mut controller = Controller::default();
    if let Ok(set) = ParameterSet::open(bytes)
        && let Ok(rest) = set.read_controller(&mut controller)
    {
        let _ = controller.corner_reach();
        let _ = rest.read_planner(&mut Planner::default());
    }
}

#[test]
fn parameter_sets() {
    let corpus = [set(&Rig::prototype()), set(&Rig::fe())];
    fuzz("parameter sets", &corpus, 4000, 2.0, open_set);
    let contents = corpus.map(|set| set[..set.len() - 4].to_vec());
    fuzz("parameter sets with their check", &contents, 4000, 2.0, |bytes| open_set(&signed(bytes)));
}

#[test]
fn places_of_parameter_sets() {
    let slot = |sequence| slot_image(&set(&Rig::prototype()), sequence).expect("fits").to_vec();
    let corpus = [slot(1), slot(u32::MAX), vec![0xFF; SLOT_BYTES]];
    fuzz("places", &corpus, 4000, 2.0, |bytes| {
        let (a, b) = bytes.split_at(bytes.len().min(SLOT_BYTES));
        let flash = FixedFlash([a.to_vec(), b.to_vec()]);
        if let Ok(Some(stored)) = stored(&flash) {
            open_set(stored.set);
        }
    });
}

#[test]
fn frames_of_the_host_line() {
    let piece = Piece::from_slice(&[7; 48]).expect("fits");
    let down = [
        Request::Describe,
        Request::Read { offset: 99 },
        Request::Begin { length: 3000 },
        Request::Append(piece.clone()),
        Request::Seal,
        Request::Restart,
    ];
    let mut corpus: Vec<Vec<u8>> = down
        .into_iter()
        .map(|request| frame(&ToBoard::Parameters(5, request)).expect("fits").to_vec())
        .collect();
    let up = ToHost::Parameters(5, Response::Piece(piece));
    corpus.push(frame(&up).expect("fits").to_vec());
    fuzz("host line", &corpus, 20_000, 1.5, |bytes| {
        let (mut board, mut host) = (FrameReader::new(), FrameReader::new());
        for byte in bytes {
            let _ = board.take::<ToBoard>(*byte);
            let _ = host.take::<ToHost>(*byte);
        }
    });
    let plain: Vec<Vec<u8>> = [Request::Begin { length: 1 }, Request::Append(Piece::new())]
        .into_iter()
        .map(|request| postcard(&ToBoard::Parameters(5, request)))
        .collect();
    fuzz("host line with its check", &plain, 20_000, 1.5, |bytes| {
        let mut coded = vec![0; cobs::max_encoding_length(bytes.len() + 4)];
        let length = cobs::encode(&signed(bytes), &mut coded);
        coded.truncate(length);
        coded.push(0);
        let (mut board, mut host) = (FrameReader::new(), FrameReader::new());
        for byte in &coded {
            let _ = board.take::<ToBoard>(*byte);
            let _ = host.take::<ToHost>(*byte);
        }
    });
}

fn read_frame(bytes: &[u8]) {
    let Some(frame) = Frame::open(bytes) else { return };
    if let Some(Body::Ticks(ticks)) = frame.body() {
        assert!(ticks.count() <= LONGEST);
    }
}

/// A frame with as much of a body as has room.
fn framed(head: Head, body: &[u8]) -> Vec<u8> {
    let mut page = FrameBuffer::EMPTY;
    let frame = page.write(head, |room| {
        let length = body.len().min(room.len());
        room[..length].copy_from_slice(&body[..length]);
        length
    });
    frame.to_vec()
}

#[test]
fn frames_of_the_log() {
    let head = |kind: Kind| Head { kind: kind as u8, sequence: 77, dropped: 3 };
    let bodies = [
        (Kind::Identity, postcard(&Identity::default())),
        (Kind::Event, postcard(&Entry { at: 9, event: Event::Command(Command::Stop) })),
        (Kind::Event, postcard(&Entry { at: 10, event: Event::Mode(Mode::Idle) })),
        (Kind::Request, vec![1; 60]),
        (Kind::Plan, vec![1; 60]),
        (Kind::Ticks, vec![3; 90]),
    ];
    let frames: Vec<Vec<u8>> =
        bodies.iter().map(|(kind, body)| framed(head(*kind), body)).collect();
    fuzz("log frames", &frames, 20_000, 1.5, read_frame);
    let plain: Vec<Vec<u8>> = bodies.iter().map(|(_, body)| body.clone()).collect();
    fuzz("log frames with their check", &plain, 10_000, 2.0, |bytes| {
        for kind in Kind::ALL {
            read_frame(&framed(head(kind), bytes));
        }
    });
}
