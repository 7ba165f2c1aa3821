//! Inputs and outputs between the host's line and the tasks.

use core::cell::Cell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex as Raw;
use embassy_sync::signal::Signal;
use interstage::hal::hil::Given;
use interstage::supervise::Command;
use interstage::units::MotorCommand;

/// What the host's line exchanges with the parts of the board that it replaces.
pub(super) struct HostIo {
    given: Mutex<Raw, Cell<Given>>,
    commands: Mutex<Raw, Cell<(MotorCommand, MotorCommand)>>,
    /// The emergency stop has cut the bridges, and no reset has re-enabled them.
    cut: Mutex<Raw, Cell<bool>>,
    /// The operator's command.
    pub(super) pressed: Signal<Raw, Command>,
}

pub(super) static HOST_IO: HostIo = HostIo {
    given: Mutex::new(Cell::new(Given {
        wheel_encoder: 0,
        preload_sensor: None,
        compression_sensor: None,
        arm_angle: None,
        bridges: None,
        stop: false,
        command: 0,
    })),
    commands: Mutex::new(Cell::new((MotorCommand::OFF, MotorCommand::OFF))),
    cut: Mutex::new(Cell::new(false)),
    pressed: Signal::new(),
};

impl HostIo {
    pub(super) fn given(&self) -> Given {
        self.given.lock(Cell::get)
    }

    pub(super) fn give(&self, given: Given) {
        self.given.lock(|place| place.set(given));
        if given.stop {
            self.cut.lock(|cut| cut.set(true));
        }
    }

    pub(super) fn commands(&self) -> (MotorCommand, MotorCommand) {
        self.commands.lock(Cell::get)
    }

    pub(super) fn apply(&self, drive: MotorCommand, preload: MotorCommand) {
        self.commands.lock(|place| place.set((drive, preload)));
    }

    pub(super) fn is_cut(&self) -> bool {
        self.cut.lock(Cell::get)
    }

    /// Re-enables the bridges, if the stop's contact is closed again.
    pub(super) fn rearm(&self) {
        if !self.given().stop {
            self.cut.lock(|cut| cut.set(false));
        }
    }
}
