//! `rig bringup` on the emulated board: its probe, and the hand and eye of the person at it.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use hil_sim::bringup::{Action, BringupError, Operator, Question, Seen};
use hil_sim::probe::{Port, PortError};

use super::bench::Bench;
use super::core::{Access, Bus};

/// Travel of the tread that an eye sees, mm.
const SEEN_MM: f64 = 0.5;
/// Time for which a hand holds the reset button, ms.
const RESET_MS: u32 = 300;
/// First address of the peripherals.
const PERIPHERALS: u32 = 0x4000_0000;

/// A bench with a probe at its board and a person beside it.
#[derive(Clone)]
pub struct Attended<'a>(Rc<RefCell<Bench<'a>>>);

impl<'a> Attended<'a> {
    /// This bench, its motor supply switched off.
    pub fn new(mut bench: Bench<'a>) -> Self {
        bench.wiring_mut().switched_off = true;
        Self(Rc::new(RefCell::new(bench)))
    }

    /// The person, whose motions `asked` allows.
    pub fn person<O: Operator>(&self, asked: O) -> Person<'a, O> {
        Person { bench: Rc::clone(&self.0), asked, tread_mm: self.tread_mm() }
    }

    fn tread_mm(&self) -> f64 {
        tread_mm(&self.0.borrow())
    }
}

fn tread_mm(bench: &Bench<'_>) -> f64 {
    let plant = bench.plant();
    plant.truth().rotation_rad * plant.parameters().ring.radius_mm
}

fn gone(error: impl std::fmt::Display) -> PortError {
    PortError::Gone(error.to_string())
}

impl Port for Attended<'_> {
    fn up(&mut self, channel: u32) -> Result<Vec<u8>, PortError> {
        let mut bench = self.0.borrow_mut();
        match channel {
            1 => Ok(bench.take_frames()),
            2 => bench.line_take().map_err(gone),
            _ => Ok(Vec::new()),
        }
    }

    fn down(&mut self, channel: u32, bytes: &[u8]) -> Result<usize, PortError> {
        let mut bench = self.0.borrow_mut();
        match channel {
            1 => bench.line_send(bytes).map_err(gone),
            _ => Err(PortError::Board(format!("nothing sends down channel {channel}"))),
        }
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.0.borrow_mut().hold_reset(1).map_err(gone)
    }

    fn memory(&mut self, address: u32, into: &mut [u8]) -> Result<(), PortError> {
        let mut bench = self.0.borrow_mut();
        let machine = bench.machine_mut();
        if address < PERIPHERALS {
            return machine.peek(address, into).map_err(gone);
        }
        let now = machine.now();
        let access = Access { address, size: 4, pc: 0, now };
        let word = machine.chip_mut().read(access).to_le_bytes();
        into.iter_mut().zip(word).for_each(|(byte, read)| *byte = read);
        Ok(())
    }

    fn pass(&mut self) -> Result<Duration, PortError> {
        self.0.borrow_mut().step().map_err(gone)?;
        Ok(Duration::from_millis(1))
    }
}

/// A person who allows what `asked` allows, and does and sees what is at the bench.
pub struct Person<'a, O> {
    bench: Rc<RefCell<Bench<'a>>>,
    asked: O,
    /// Where the tread was when it was last looked at.
    tread_mm: f64,
}

impl<O: Operator> Operator for Person<'_, O> {
    fn confirm(&mut self, motion: &str) -> Result<(), BringupError> {
        self.asked.confirm(motion)?;
        self.tread_mm = tread_mm(&self.bench.borrow());
        Ok(())
    }

    fn act(&mut self, action: Action) -> Result<(), BringupError> {
        let mut bench = self.bench.borrow_mut();
        self.tread_mm = tread_mm(&bench);
        let wiring = bench.wiring_mut();
        match action {
            Action::SwitchOn => wiring.switched_off = false,
            Action::PressStop => wiring.stop_pressed = true,
            Action::ReleaseStop => wiring.stop_pressed = false,
            Action::Unplug(sensor) => wiring.unplugged.push(sensor),
            Action::Plug(sensor) => wiring.unplugged.retain(|known| *known != sensor),
            Action::HoldReset => bench.hold_reset(RESET_MS).map_err(gone)?,
        }
        bench.connect();
        Ok(())
    }

    fn look(&mut self, question: Question) -> Result<Seen, BringupError> {
        let bench = self.bench.borrow();
        let turned = tread_mm(&bench) - self.tread_mm;
        let moved = if turned > SEEN_MM {
            Seen::Outwards
        } else if turned < -SEEN_MM {
            Seen::Inwards
        } else {
            Seen::Nothing
        };
        Ok(match question {
            Question::Turned => moved,
            Question::MovedInReset if moved == Seen::Nothing => Seen::Nothing,
            Question::MovedInReset => Seen::Yes,
            Question::Supplied if bench.wiring().is_supplied() => Seen::Yes,
            Question::Supplied => Seen::Nothing,
        })
    }
}
