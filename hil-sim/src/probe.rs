//! A debug probe as everything here needs it: rings in the board's memory, a reset, and
//! memory itself. One interface, a real probe or the emulated board behind it.

#[cfg(feature = "probe")]
mod real;
mod reconnecting;

use std::time::Duration;

#[cfg(feature = "probe")]
pub use real::RealPort;
pub use reconnecting::ReconnectingPort;
#[cfg(test)]
pub(crate) use reconnecting::tests as script;

/// Why a port did not do it. Each is one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PortError {
    /// There is no probe, or more than one.
    #[error("{0}")]
    Absent(String),
    /// Probe or board no longer answer; they may come back.
    #[error("the debug probe does not answer: {0}")]
    Gone(String),
    /// The board is not what it should be.
    #[error("{0}")]
    Board(String),
}

/// The connection to a board.
pub trait Port {
    /// Takes what an RTT channel has sent up; nothing before the firmware has set its
    /// channels up.
    ///
    /// # Errors
    /// [`PortError`] if the connection is broken, or the image has no such channel.
    fn up(&mut self, channel: u32) -> Result<Vec<u8>, PortError>;

    /// Sends bytes down an RTT channel, as many as there is room for; gives how many.
    ///
    /// # Errors
    /// As [`Port::up`].
    fn down(&mut self, channel: u32, bytes: &[u8]) -> Result<usize, PortError>;

    /// Resets the board.
    ///
    /// # Errors
    /// As [`Port::up`].
    fn reset(&mut self) -> Result<(), PortError>;

    /// Reads memory.
    ///
    /// # Errors
    /// As [`Port::up`].
    fn memory(&mut self, address: u32, into: &mut [u8]) -> Result<(), PortError>;

    /// Lets a little time pass before the board is looked at again, and gives how much.
    ///
    /// # Errors
    /// As [`Port::up`].
    fn pass(&mut self) -> Result<Duration, PortError>;
}
