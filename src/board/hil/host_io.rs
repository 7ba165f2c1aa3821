//! Inputs and outputs between the host's line and the tasks.

use core::cell::Cell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex as Raw;
use embassy_sync::signal::Signal;
use interstage::hal::hil::Given;
use interstage::supervise::Command;
use interstage::units::MotorCommand;

/// What the host's line exchanges with the parts of the board that it replaces.
#[derive(Clone, Copy)]
pub(super) struct HostIo {
    pub(super) given: Given,
    /// Of drive and pre-tightener.
    pub(super) commands: (MotorCommand, MotorCommand),
    /// The emergency stop has cut the bridges, and no reset has re-enabled them.
    pub(super) cut: bool,
}

static HOST_IO: Mutex<Raw, Cell<HostIo>> = Mutex::new(Cell::new(HostIo {
    given: Given::NOTHING,
    commands: (MotorCommand::OFF, MotorCommand::OFF),
    cut: false,
}));

/// The operator's command.
pub(super) static PRESSED: Signal<Raw, Command> = Signal::new();

pub(super) fn get() -> HostIo {
    HOST_IO.lock(Cell::get)
}

pub(super) fn change(make: impl FnOnce(&mut HostIo)) {
    HOST_IO.lock(|place| {
        let mut io = place.get();
        make(&mut io);
        place.set(io);
    });
}
