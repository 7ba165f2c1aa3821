//! The emulated probe, as a host has it.

use std::time::Duration;

use clap::Parser;
use hil_sim::cli::{capture, live};
use hil_sim::probe::{Port, PortError, ReconnectingPort};
use hil_sim::record::{Columns, Decoder, Item, Probed, Run, Source, SourceError};
use hil_sim::replay::replay;
use hil_sim::scenario::injection::{Injection, Kind, Target};
use interstage::fault::Limit;
use interstage::rig::Rig;
use interstage::supervise::Mode;
use interstage::tick::Event;
use rig_board::bench::Bench;
use rig_board::log::Reader;
use rig_board::peripherals::rcc::Cause;
use rig_board::port::EmulatedPort;

use crate::common::{OnUsb, elf, scenario, strings};

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

#[derive(Parser)]
enum Verb {
    Capture(capture::Args),
    Live(live::Args),
}

/// An operator who starts the drive when the log shows it idle, and ends when it has arrived.
struct Operated<'a>(Probed<'a>, Decoder, Mode);

impl Source for Operated<'_> {
    fn read(&mut self) -> Result<Option<Vec<u8>>, SourceError> {
        let Self(probed, decoder, mode) = self;
        let (before, bytes) = (*mode, probed.read()?.unwrap_or_default());
        decoder.read(&bytes, &mut |item| {
            if let Item::Tick(record, _) = item {
                *mode = record.telemetry.mode;
            }
        });
        if *mode == Mode::Idle && before != Mode::Idle {
            probed.send(b's')?;
        }
        Ok((!matches!(before, Mode::Complete(_))).then_some(bytes))
    }

    fn send(&mut self, letter: u8) -> Result<(), SourceError> {
        self.0.send(letter)
    }
}

/// The probe attaches to a board that idles, and the board is reset under way.
#[test]
fn capture_and_live_over_a_slow_probe_keep_both_starts_of_a_board_that_is_reset() {
    for verb in ["capture --json --out", "live --headless --fast --listen 127.0.0.1:0 --record"] {
        let mut scenario = scenario(&[]);
        scenario.run.faults = vec![Injection::at(Target::ResetPin, Kind::Reset, 4.0, 0.0)];
        let mut bench = Bench::new(elf(), strings(), &scenario).expect("a bench");
        bench.listen(false);
        (0..1000).for_each(|_| drop(bench.step().expect("runs")));
        bench.attach();
        let mut port = Some(Box::new(OnUsb::new(bench)) as Box<dyn Port>);
        let attach = || port.take().ok_or(PortError::Gone("once".to_owned()));
        let port = ReconnectingPort::open(attach, Duration::ZERO, Duration::ZERO).expect("a port");
        let mut source = Operated(Probed::new(port), Decoder::new(), Mode::Boot);
        let folder = tempfile::tempdir().expect("a directory");
        let words = format!("rig {verb} {}", folder.path().display());
        let ended = match Verb::parse_from(words.split(' ')) {
            Verb::Capture(args) => capture::write(&args, &mut source, &scenario),
            Verb::Live(args) => live::watch(&args, &mut source, &scenario),
        };
        ended.expect("a log");
        let run = Run::read(&folder.path().join("log.mcap")).expect("a log");
        let halted = Event::Limit(Limit::CoreHalted);
        let halts = run.events.iter().filter(|entry| entry.event == halted).count();
        assert_eq!((halts, run.counts.restarts), (1, 1), "{verb}: {:?}", run.marks);
        let last = |boot| run.since_boot(boot).rows.last().and_then(Columns::telemetry);
        let modes = [0, 1].map(|boot| last(boot).expect("rows").mode);
        assert!(matches!(modes, [Mode::Run(..), Mode::Complete(_)]), "{verb}: {modes:?}");
        // The ring holds less than what comes in the probe's longest pauses: that is marked.
        assert!(run.counts.garbage_bytes == 0 && run.rows.len() > 4000, "{:?}", run.counts);
        assert!(replay(&run, &Rig::prototype()).expect("a sound rig").difference.is_none());
    }
}
