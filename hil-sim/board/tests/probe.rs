//! The emulated probe, as a host has it.

use std::time::Duration;

use hil_sim::probe::Port;
use rig_board::log::Reader;
use rig_board::peripherals::rcc::Cause;
use rig_board::port::EmulatedPort;

use crate::common::{OnUsb, elf, strings};

fn port() -> EmulatedPort {
    EmulatedPort::new(elf()).expect("an image")
}

/// Polls the text log for so many milliseconds; whether it had this text.
fn heard(port: &mut EmulatedPort, reader: &mut Reader<'_>, text: &str, milliseconds: u32) -> bool {
    let (until, mut found) = (port.now() + Duration::from_millis(milliseconds.into()), false);
    while port.now() < until {
        port.pass().expect("runs");
        let lines = reader.read(&port.up(0).expect("reads"));
        found |= lines.iter().any(|line| line.text.contains(text));
    }
    found
}

/// The host has not seen the restart when the key is pressed: it goes to another run than the one
/// that the operator looks at.
#[test]
fn a_board_that_restarts_is_heard_again_and_gets_no_key_meanwhile() {
    let (mut port, mut reader) = (port(), strings().reader());
    assert!(heard(&mut port, &mut reader, "interstage", 600));
    assert_eq!(port.down(0, b"x"), Ok(1));
    let machine = &mut port.machine;
    machine.restart(Cause::Watchdog).expect("restarts");
    machine.run_on(machine.now() + 100 * rig_board::bench::STEP).expect("runs");
    assert_eq!(port.down(0, b"s"), Ok(0), "it looks at the run before");
    assert_eq!(port.down(0, b"s"), Ok(0), "found again, but not heard yet");
    let mut reader = strings().reader();
    assert!(heard(&mut port, &mut reader, "restarted by the watchdog", 100));
    assert!(!heard(&mut port, &mut reader, "start", 900), "the key came all the same");
    assert_eq!(port.down(0, b"s"), Ok(1));
}

/// Every time-out counts by what the port says.
#[test]
fn the_time_of_a_port_includes_that_of_its_accesses() {
    let mut port = OnUsb::new(port());
    let (before, since) = (port.port.machine.now(), port.now());
    for _ in 0..50 {
        for _ in 0..10 {
            port.up(0).expect("reads");
        }
        port.pass().expect("runs");
    }
    let passed = port.now() - since;
    let true_s = (port.port.machine.now() - before) as f64 / 170e6;
    assert!(true_s > 0.37, "500 accesses, one of them long");
    assert!((passed.as_secs_f64() - true_s).abs() < 1e-3, "{passed:?} of {true_s} s");
}
