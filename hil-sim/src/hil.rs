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
    #[error("the firmware schedules: --controller {0} runs in software alone")]
    Controller(&'static str),
    #[error(transparent)]
    Rig(#[from] RigError),
    #[error("plant: {0}")]
    Refused(#[from] Refusal),
    #[error(transparent)]
    Plant(#[from] PlantError),
    #[error("the board does not answer: it takes firmware with the feature `hil` of this version")]
    NoAnswer,
    #[error("the board fell silent at tick {0}")]
    Silent(u32),
    #[error("the board is at tick {board}, this host at {host}: it has restarted meanwhile")]
    Apart {
        /// The board's next tick.
        board: u32,
        host: u32,
    },
    #[error(
        "this host was too slow: the board has turned its bridges off and gone on alone at \
         tick {0}"
    )]
    Alone(u32),
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
    #[error("the log lacks tick {0}, so that the run cannot be reported")]
    Incomplete(u32),
}
