//! The interface of a debug probe: RTT channels, reset, memory. Behind it is a real probe or
//! the emulated board.

mod channels;
#[cfg(feature = "probe")]
mod real;
mod reconnecting;

use std::time::Duration;

pub use channels::{Access, ChannelError, Channels, Rtt};
#[cfg(feature = "probe")]
pub use real::RealPort;
pub use reconnecting::ReconnectingPort;
#[cfg(test)]
pub(crate) use reconnecting::tests as script;

/// Why a port failed. Displays as one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PortError {
    /// There is no probe, or more than one.
    #[error("{0}")]
    Absent(String),
    /// Probe or board no longer answer; they may come back.
    #[error("the debug probe does not answer: {0}")]
    Gone(String),
    /// The board is not the expected one.
    #[error("{0}")]
    Board(String),
}

/// The connection to a board.
pub trait Port {
    /// Takes the bytes that an RTT channel has sent up; none before the firmware has set its
    /// channels up.
    fn up(&mut self, channel: u32) -> Result<Vec<u8>, PortError>;

    /// Sends bytes down an RTT channel, as many as there is room for; returns how many. None go to
    /// a board that has restarted since it was last read, and no key before its log was read.
    fn down(&mut self, channel: u32, bytes: &[u8]) -> Result<usize, PortError>;

    fn reset(&mut self) -> Result<(), PortError>;

    /// Reads memory.
    fn memory(&mut self, address: u32, into: &mut [u8]) -> Result<(), PortError>;

    /// Waits before the next poll of the board; returns how long this and the accesses since the
    /// last call took.
    fn pass(&mut self) -> Result<Duration, PortError>;
}
