//! The task at the host's binary line, on a mocked line and flash.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::OnceLock;

use crate::common::{Bench, FixedFlash, forever};
use interstage::hal::Line;
use interstage::params::Refusal;
use interstage::params::compile;
use interstage::params::link::{FrameReader, ToBoard, ToHost, frame};
use interstage::params::service::{Origin, Request, Response, Service};
use interstage::rig::Rig;
use interstage::tasks::{self, Exchange};

/// Both ends of a line; clones share it.
#[derive(Clone, Default)]
pub(crate) struct Wire(Rc<RefCell<Ends>>);

#[derive(Default)]
struct Ends {
    to_board: VecDeque<u8>,
    to_host: Vec<u8>,
    restarts: u32,
}

impl Line for Wire {
    fn read(&mut self, bytes: &mut [u8]) -> usize {
        let mut ends = self.0.borrow_mut();
        let count = bytes.len().min(ends.to_board.len());
        for byte in &mut bytes[..count] {
            *byte = ends.to_board.pop_front().expect("counted");
        }
        count
    }

    fn write(&mut self, bytes: &[u8]) -> bool {
        self.0.borrow_mut().to_host.extend(bytes);
        true
    }

    fn restart(&mut self) {
        self.0.borrow_mut().restarts += 1;
    }
}

impl Wire {
    pub(crate) fn ask(&self, number: u16, request: Request) {
        let frame = frame(&ToBoard::Parameters(number, request)).expect("it fits");
        self.0.borrow_mut().to_board.extend(&frame);
    }

    pub(crate) fn answers(&self) -> Vec<ToHost> {
        let mut gatherer = FrameReader::new();
        let bytes = std::mem::take(&mut self.0.borrow_mut().to_host);
        bytes.into_iter().filter_map(|byte| gatherer.take(byte)).collect()
    }
}

fn image() -> &'static [u8] {
    static SET: OnceLock<Vec<u8>> = OnceLock::new();
    SET.get_or_init(|| compile("mocked", &Rig::prototype()).expect("sound").to_vec())
}

fn bench() -> (Bench, Wire, &'static Exchange) {
    let (mut bench, wire, exchange) = (Bench::new(), Wire::default(), forever(Exchange::default()));
    spawn_link(&mut bench, &wire, exchange);
    (bench, wire, exchange)
}

/// Adds the task at the line.
pub(crate) fn spawn_link(bench: &mut Bench, wire: &Wire, exchange: &'static Exchange) {
    let (line, service) = (wire.clone(), Service::new(FixedFlash::blank(), image(), 0xAFFE));
    bench.spawn(async move { tasks::link(line, service, exchange).await });
}

#[test]
fn each_request_has_its_answer_with_its_number() {
    let (mut bench, wire, exchange) = bench();
    assert!(exchange.at_rest());
    bench.run_ms(20);
    assert_eq!(wire.answers(), []);
    wire.ask(7, Request::Describe);
    wire.ask(8, Request::Read { offset: 0 });
    wire.ask(9, Request::Seal);
    bench.run_ms(20);
    let answers = wire.answers();
    let [ToHost::Parameters(7, Response::Description(found)), piece, refused] = &answers[..] else {
        panic!("{answers:?}");
    };
    assert_eq!((found.origin, found.name.as_str()), (Origin::Image, "mocked"));
    assert_eq!((usize::from(found.length), found.running), (image().len(), 0xAFFE));
    let ToHost::Parameters(8, Response::Piece(piece)) = piece else { panic!("{piece:?}") };
    assert!(!piece.is_empty() && image().starts_with(piece));
    assert_eq!(*refused, ToHost::Parameters(9, Response::Refused(Refusal::NoDraft)));
}

#[test]
fn noise_is_no_request() {
    let (mut bench, wire, _) = bench();
    wire.0.borrow_mut().to_board.extend([7, 0, 1, 2, 3, 0, 0]);
    wire.ask(1, Request::Begin { length: 8 });
    bench.run_ms(20);
    // The mocked flash cannot be erased.
    assert_eq!(wire.answers(), [ToHost::Parameters(1, Response::Refused(Refusal::Flash))]);
}

#[test]
fn a_restart_is_answered_before_it_comes() {
    let (mut bench, wire, _) = bench();
    wire.ask(3, Request::Restart);
    bench.run_ms(15);
    assert_eq!(wire.answers(), [ToHost::Parameters(3, Response::Done)]);
    assert_eq!(wire.0.borrow().restarts, 0);
    bench.run_ms(20);
    assert_eq!(wire.0.borrow().restarts, 1);
}
