//! Hardware in the loop: the plant on this host, the controller on a board, a port in
//! between ([`interstage::hal::hil`]).
//!
//! The loop runs in lockstep, so that the speed of the port has no effect: a run gives the
//! same trace as in software, bit for bit.

mod line;
mod run;

use interstage::rig::RigError;

use crate::plant::limits::Refusal;
use crate::plant::rig::PlantError;
use crate::probe::PortError;

pub use crate::firmware::Image;
pub use line::HostLine;
pub use run::{Asked, run};

/// Why a run could not be made. Each is one line.
#[derive(Debug, thiserror::Error)]
pub enum HilError {
    #[error(transparent)]
    Port(#[from] PortError),
    /// The firmware has one controller.
    #[error("the firmware schedules: --controller {0} runs in software alone")]
    Controller(&'static str),
    /// The parameters do not make a planner.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The plant of this seed cannot be computed.
    #[error("plant: {0}")]
    Refused(#[from] Refusal),
    /// The plant's state became invalid.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// Nothing answers in this protocol.
    #[error("the board does not answer: it takes firmware with the feature `hil` of this version")]
    NoAnswer,
    /// The board fell silent.
    #[error("the board fell silent at tick {0}")]
    Silent(u32),
    /// Board and host are at different ticks.
    #[error("the board is at tick {board}, this host at {host}: it has restarted meanwhile")]
    Apart {
        /// The board's next tick.
        board: u32,
        host: u32,
    },
    /// The board's timeout for its host has passed.
    #[error(
        "this host was too slow: the board has turned its bridges off and gone on alone at \
         tick {0}"
    )]
    Alone(u32),
    /// The board's parameters differ from the scenario's.
    #[error(
        "the board runs on {board} ({board_hash}), the scenario is {scenario} \
         ({scenario_hash}): `rig params restore FILE` puts a scenario's rig into the board"
    )]
    Parameters {
        /// Name of the board's rig.
        board: String,
        /// Hash of its parameters.
        board_hash: String,
        /// Name of the scenario's.
        scenario: String,
        /// Hash of its parameters.
        scenario_hash: String,
    },
    /// The log lacks a tick.
    #[error("the log lacks tick {0}, so that the run cannot be reported")]
    Incomplete(u32),
}
