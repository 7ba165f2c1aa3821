//! `rig bringup` on the emulated board: its probe, and the hand and eye of the person at it.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use hil_sim::bringup::{Action, BringupError, Operator, Question, Seen};
use hil_sim::probe::{Port, PortError};
use interstage::sense::raw::SensorId;

use super::bench::Bench;
use super::port::gone;

/// Travel of the tread that an eye sees, mm.
const SEEN_MM: f64 = 0.5;
/// Time for which the emergency stop is pressed while a hand reaches in, ms.
const REACHES_MS: u32 = 200;
/// Time for which a hand holds the reset button, ms.
const RESET_MS: u32 = 300;

/// What is written on the two weights, N, and gauges, mm, and what they are.
const WEIGHTS: [(f64, f64); 2] = [(5.0, 5.01), (15.0, 14.96)];
const GAUGES: [(f64, f64); 2] = [(1.0, 1.003), (3.0, 2.996)];

/// A bench with a probe at its board and a person beside it.
pub struct Attended<'a> {
    bench: Rc<RefCell<Bench<'a>>>,
}

impl<'a> Attended<'a> {
    /// This bench, its motor supply switched off.
    pub fn new(mut bench: Bench<'a>) -> Self {
        bench.wiring.switched_off = true;
        Self { bench: Rc::new(RefCell::new(bench)) }
    }

    /// The person, whose motions `asked` allows.
    pub fn person<O: Operator>(&self, asked: O) -> Person<'a, O> {
        let tread_mm = self.bench.borrow().tread_mm();
        Person { bench: Rc::clone(&self.bench), asked, tread_mm }
    }
}

impl Port for Attended<'_> {
    fn up(&mut self, channel: u32) -> Result<Vec<u8>, PortError> {
        self.bench.borrow_mut().up(channel)
    }

    fn down(&mut self, channel: u32, bytes: &[u8]) -> Result<usize, PortError> {
        self.bench.borrow_mut().down(channel, bytes)
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.bench.borrow_mut().reset()
    }

    fn memory(&mut self, address: u32, into: &mut [u8]) -> Result<(), PortError> {
        self.bench.borrow_mut().memory(address, into)
    }

    fn pass(&mut self) -> Result<(), PortError> {
        self.bench.borrow_mut().pass()
    }

    fn now(&self) -> Duration {
        self.bench.borrow().now()
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
        self.tread_mm = self.bench.borrow().tread_mm();
        Ok(())
    }

    fn act(&mut self, action: Action) -> Result<(), BringupError> {
        let mut bench = self.bench.borrow_mut();
        self.tread_mm = bench.tread_mm();
        let reaches_in = matches!(action, Action::Block | Action::SetDown | Action::LiftOff);
        if reaches_in {
            bench.wiring.stop_pressed = true;
            bench.connect();
            (0..REACHES_MS).try_for_each(|_| bench.pass())?;
            bench.wiring.stop_pressed = false;
        }
        let wiring = &mut bench.wiring;
        match action {
            Action::SwitchOn => wiring.switched_off = false,
            Action::PressStop => wiring.stop_pressed = true,
            Action::ReleaseStop => wiring.stop_pressed = false,
            Action::Unplug(sensor) => wiring.unplugged.push(sensor),
            Action::Plug(sensor) => wiring.unplugged.retain(|known| *known != sensor),
            Action::Block => bench.plant.block(),
            Action::SetDown | Action::LiftOff | Action::TakeOff(_) => bench.plant.lift(0.0, None),
            Action::HoldReset => bench.hold_reset(RESET_MS).map_err(gone)?,
        }
        bench.connect();
        Ok(())
    }

    fn look(&mut self, question: Question) -> Result<Seen, BringupError> {
        let bench = self.bench.borrow();
        let turned = bench.tread_mm() - self.tread_mm;
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
            Question::Supplied if bench.wiring.is_supplied() => Seen::Yes,
            Question::Supplied => Seen::Nothing,
        })
    }

    fn put(&mut self, sensor: SensorId, is_second: bool) -> Result<f64, BringupError> {
        let (plant, which) = (&mut self.bench.borrow_mut().plant, usize::from(is_second));
        if sensor == SensorId::PreloadSensor {
            plant.lift(WEIGHTS[which].1, None);
            return Ok(WEIGHTS[which].0);
        }
        plant.lift(0.0, Some(GAUGES[which].1));
        Ok(GAUGES[which].0)
    }
}
