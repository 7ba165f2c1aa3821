//! What the host's line and the tasks leave for each other.

use core::cell::Cell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use interstage::hal::hil::Given;
use interstage::supervise::Command;
use interstage::units::MotorCommand;

/// Between the host's line and the parts of the board that it stands in for.
pub(super) struct Desk {
    given: Mutex<CriticalSectionRawMutex, Cell<Given>>,
    commands: Mutex<CriticalSectionRawMutex, Cell<(MotorCommand, MotorCommand)>>,
    /// The emergency stop has cut the bridges and they have not been given back.
    cut: Mutex<CriticalSectionRawMutex, Cell<bool>>,
    /// The operator's command.
    pub(super) pressed: Signal<CriticalSectionRawMutex, Command>,
}

/// The only one.
pub(super) static DESK: Desk = Desk {
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

impl Desk {
    /// What the present tick finds.
    pub(super) fn given(&self) -> Given {
        self.given.lock(Cell::get)
    }

    /// Leaves what the next tick is to find.
    pub(super) fn give(&self, given: Given) {
        self.given.lock(|place| place.set(given));
        if given.stop {
            self.cut.lock(|cut| cut.set(true));
        }
    }

    /// What the bridges were last told.
    pub(super) fn commands(&self) -> (MotorCommand, MotorCommand) {
        self.commands.lock(Cell::get)
    }

    /// Tells the bridges.
    pub(super) fn apply(&self, drive: MotorCommand, preload: MotorCommand) {
        self.commands.lock(|place| place.set((drive, preload)));
    }

    /// Whether the emergency stop has cut the bridges.
    pub(super) fn is_cut(&self) -> bool {
        self.cut.lock(Cell::get)
    }

    /// Gives the bridges back, if the stop's contact is closed again.
    pub(super) fn rearm(&self) {
        if !self.given().stop {
            self.cut.lock(|cut| cut.set(false));
        }
    }
}
