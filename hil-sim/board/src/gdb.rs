//! A debugger on the emulated board, over GDB's remote protocol: registers, memory,
//! breakpoints, single steps. The plant follows the board's own clock.
//!
//! A breakpoint is a `BKPT` in the place of an instruction, which is restored before it is
//! executed. Access to memory and registers takes no time.

mod arch;
mod target;

use std::collections::BTreeMap;
use std::io;
use std::net::{TcpListener, TcpStream};

use gdbstub::common::Signal;
use gdbstub::conn::ConnectionExt;
use gdbstub::stub::run_blocking::{BlockingEventLoop, Event, WaitForStopReasonError};
use gdbstub::stub::{DisconnectReason, GdbStub, SingleThreadStopReason};

use super::bench::Bench;
use super::error::BoardError;
use super::log::{Line, Strings};
use hil_sim::scenario::Scenario;

use target::Fatal;

/// `BKPT 0`.
const BREAK: [u8; 2] = [0x00, 0xBE];
/// Port if none is given.
const PORT: u16 = 3333;

/// Why there is no debugging.
#[derive(Debug, thiserror::Error)]
pub enum GdbError {
    /// The address cannot be listened at.
    #[error("{address}: {source}")]
    Listen {
        address: String,
        /// Why.
        source: io::Error,
    },
    #[error("the debugger's connection failed: {0}")]
    Connection(String),
    /// The board or its plant.
    #[error(transparent)]
    Bench(#[from] BoardError),
}

/// Listens at `[host]:[port]`; without a host on this machine alone.
pub fn listen(address: &str) -> Result<TcpListener, GdbError> {
    let (host, port) = address.rsplit_once(':').unwrap_or((address, ""));
    let host = if host.is_empty() { "127.0.0.1" } else { host };
    let port = if port.is_empty() { Ok(PORT) } else { port.parse() };
    let failed = |source| GdbError::Listen { address: address.to_owned(), source };
    let port = port.map_err(|error| failed(io::Error::new(io::ErrorKind::InvalidInput, error)))?;
    TcpListener::bind((host, port)).map_err(failed)
}

/// Waits for a debugger and serves the board with the image in `elf` to it, from the first
/// instruction on. The drive starts once it is idle. Returns when the debugger disconnects.
pub fn serve(
    listener: &TcpListener,
    elf: &[u8],
    scenario: &Scenario,
    watch: impl FnMut(f64, &Line),
) -> Result<(), GdbError> {
    let (stream, _) = listener.accept().map_err(|error| GdbError::Connection(error.to_string()))?;
    let strings = Strings::of(elf).map_err(BoardError::from)?;
    let mut bench = Bench::new(elf, &strings, scenario).map_err(BoardError::from)?;
    bench.start_when_idle();
    let mut board =
        Debugged { bench, breaks: BTreeMap::new(), steps: false, watch: Box::new(watch) };
    match GdbStub::new(stream).run_blocking::<Loop>(&mut board) {
        Ok(DisconnectReason::Disconnect | DisconnectReason::Kill) => Ok(()),
        Ok(reason) => Err(GdbError::Connection(format!("{reason:?}"))),
        Err(error) if error.is_target_error() => Err(error
            .into_target_error()
            .map_or(GdbError::Connection(String::new()), |e| GdbError::Bench(e.0))),
        Err(error) => Err(GdbError::Connection(error.to_string())),
    }
}

/// Gets each line of the log with its time, s.
type Watch<'a> = Box<dyn FnMut(f64, &Line) + 'a>;

/// A board under a debugger.
struct Debugged<'a> {
    bench: Bench<'a>,
    /// Breakpoints with the code that they replace.
    breaks: BTreeMap<u32, [u8; 2]>,
    /// The debugger has requested a single step.
    steps: bool,
    watch: Watch<'a>,
}

impl Debugged<'_> {
    /// Ends the millisecond if its time is over.
    fn close(&mut self) -> Result<(), BoardError> {
        if self.bench.is_due() {
            let (_, lines) = self.bench.close()?;
            for line in &lines {
                (self.watch)(self.bench.time_s(), line);
            }
        }
        Ok(())
    }

    /// Executes the instruction at the program counter, even under a breakpoint.
    fn step(&mut self) -> Result<(), BoardError> {
        let machine = self.bench.machine_mut();
        let place = machine.pc();
        if let Some(kept) = self.breaks.get(&place) {
            machine.poke(place, kept)?;
        }
        self.bench.step_instruction()?;
        if self.breaks.contains_key(&place) {
            self.bench.machine_mut().poke(place, &BREAK)?;
        }
        self.close()
    }

    /// Runs to a breakpoint, or to the end of the millisecond.
    fn run(&mut self) -> Result<Option<SingleThreadStopReason<u32>>, BoardError> {
        if self.breaks.contains_key(&self.bench.machine().pc()) {
            self.step()?;
        }
        let stop = self.bench.run_to_break()?;
        self.close()?;
        Ok(stop.map(|place| match self.breaks.contains_key(&place) {
            true => SingleThreadStopReason::SwBreak(()),
            false => SingleThreadStopReason::Signal(Signal::SIGTRAP),
        }))
    }
}

/// Connects the debugger's loop to the board.
struct Loop<'a>(std::marker::PhantomData<&'a ()>);

type Waited<'a> = Result<
    Event<SingleThreadStopReason<u32>>,
    WaitForStopReasonError<Fatal, <TcpStream as gdbstub::conn::Connection>::Error>,
>;

impl<'a> BlockingEventLoop for Loop<'a> {
    type Target = Debugged<'a>;
    type Connection = TcpStream;
    type StopReason = SingleThreadStopReason<u32>;

    fn wait_for_stop_reason(board: &mut Debugged<'a>, stream: &mut TcpStream) -> Waited<'a> {
        let failed = |error: BoardError| WaitForStopReasonError::Target(Fatal(error));
        loop {
            if stream.peek().map_err(WaitForStopReasonError::Connection)?.is_some() {
                let byte =
                    ConnectionExt::read(stream).map_err(WaitForStopReasonError::Connection)?;
                return Ok(Event::IncomingData(byte));
            }
            if board.steps {
                board.step().map_err(failed)?;
                return Ok(Event::TargetStopped(SingleThreadStopReason::DoneStep));
            }
            if let Some(stop) = board.run().map_err(failed)? {
                return Ok(Event::TargetStopped(stop));
            }
        }
    }

    fn on_interrupt(_: &mut Debugged<'a>) -> Result<Option<Self::StopReason>, Fatal> {
        Ok(Some(SingleThreadStopReason::Signal(Signal::SIGINT)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_host_it_listens_on_this_machine_only() {
        let listener = listen(":0").expect("a port");
        assert!(listener.local_addr().expect("bound").ip().is_loopback());
    }

    #[test]
    fn an_invalid_address_is_named() {
        for address in [":x", ":99999", "no such host:1"] {
            let error = listen(address).expect_err("none").to_string();
            assert!(error.starts_with(address), "{error}");
        }
    }
}
