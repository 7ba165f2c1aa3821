//! The interface of a debug probe: RTT channels, reset, memory. Behind it is a real probe or
//! the emulated board.

mod channels;
#[cfg(feature = "probe")]
mod real;
mod reconnecting;

use std::time::Duration;

use interstage::params::link::FrameReader;
use serde::de::DeserializeOwned;

pub use channels::{Access, ChannelError, Channels, Rtt};
#[cfg(feature = "probe")]
pub(crate) use real::RealPort;
pub use reconnecting::ReconnectingPort;
#[cfg(test)]
pub(crate) use reconnecting::tests as script;
#[cfg(test)]
pub(crate) use tests::Mute;

/// RTT channels of the board: up those of the text log and of the binary log, down the console's.
pub(crate) const TEXT: u32 = 0;
pub(crate) const LOG: u32 = 1;
pub(crate) const CONSOLE: u32 = 0;

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

    fn memory(&mut self, address: u32, into: &mut [u8]) -> Result<(), PortError>;

    /// Waits before the next poll of the board.
    fn pass(&mut self) -> Result<(), PortError>;

    /// Time of the board since the port was opened: elapsed or emulated.
    fn now(&self) -> Duration;
}

/// Sends a frame down a channel, again after each `retry` without an answer, until `picked` takes a
/// message that has come up another; none within `timeout`, of the board's time.
pub(crate) fn exchange<M: DeserializeOwned, T>(
    port: &mut (impl Port + ?Sized),
    reader: &mut FrameReader,
    (down, up): (u32, u32),
    frame: &[u8],
    (retry, timeout): (Duration, Duration),
    mut picked: impl FnMut(M) -> Option<T>,
) -> Result<Option<T>, PortError> {
    let since = port.now();
    let (mut left, mut sent) = (frame, since);
    while port.now().saturating_sub(since) < timeout {
        if left.is_empty() && port.now() >= sent + retry {
            left = frame;
        }
        if !left.is_empty() {
            left = &left[port.down(down, left)?..];
            sent = port.now();
        }
        port.pass()?;
        for byte in port.up(up)? {
            if let Some(answer) = reader.take(byte).and_then(&mut picked) {
                return Ok(Some(answer));
            }
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A board that takes nothing and says nothing, behind a slow probe: each transfer takes as
    /// long as many a pause between two.
    pub(crate) struct Mute(Duration);

    impl Mute {
        pub(crate) const fn new() -> Self {
            Self(Duration::ZERO)
        }
    }

    impl Port for Mute {
        fn up(&mut self, _: u32) -> Result<Vec<u8>, PortError> {
            self.0 += Duration::from_millis(2);
            Ok(Vec::new())
        }

        fn down(&mut self, _: u32, _: &[u8]) -> Result<usize, PortError> {
            self.0 += Duration::from_millis(2);
            Ok(0)
        }

        fn reset(&mut self) -> Result<(), PortError> {
            Ok(())
        }

        fn memory(&mut self, _: u32, _: &mut [u8]) -> Result<(), PortError> {
            Ok(())
        }

        fn pass(&mut self) -> Result<(), PortError> {
            self.0 += Duration::from_micros(200);
            Ok(())
        }

        fn now(&self) -> Duration {
            self.0
        }
    }
}
