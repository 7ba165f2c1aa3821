//! RTT channels over a probe: a handle to them, which a restart of the board makes stale.

use super::CONSOLE;

/// Why an access to a channel failed.
#[derive(Debug)]
pub enum ChannelError<E> {
    /// The board has restarted since the handle was made, or its channels are damaged.
    Stale,
    /// The access itself.
    Failed(E),
}

pub type Access<T, E> = Result<T, ChannelError<E>>;

impl<E> From<E> for ChannelError<E> {
    fn from(error: E) -> Self {
        Self::Failed(error)
    }
}

/// RTT as a probe has it. A handle remembers the read offset of each channel; another one on the
/// board means that the board has set its channels up again.
pub trait Rtt {
    type Handle;
    type Error;

    /// Finds the channels; none before the firmware has set them up.
    fn attach(&mut self) -> Result<Option<Self::Handle>, Self::Error>;

    /// Takes the bytes that a channel has sent up.
    fn read(&mut self, handle: &mut Self::Handle, channel: u32) -> Access<Vec<u8>, Self::Error>;

    /// Sends bytes down a channel, as many as there is room for; returns how many. Fails if the
    /// read offset of the channel `heard` is another one than after its last read.
    fn write(
        &mut self,
        handle: &mut Self::Handle,
        heard: Option<u32>,
        channel: u32,
        bytes: &[u8],
    ) -> Access<usize, Self::Error>;
}

/// The channels of a board that may restart: a stale handle is dropped, and the next access finds
/// the channels anew.
#[derive(Debug)]
pub struct Channels<H> {
    handle: Option<H>,
    /// The channel that has given bytes last, since the handle was made.
    heard: Option<u32>,
}

impl<H> Default for Channels<H> {
    fn default() -> Self {
        Self { handle: None, heard: None }
    }
}

impl<H> Channels<H> {
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    /// Takes the bytes that a channel has sent up; none while there is no channel.
    pub fn up<R>(&mut self, rtt: &mut R, channel: u32) -> Result<Vec<u8>, R::Error>
    where
        R: Rtt<Handle = H>,
    {
        let bytes = self.with(rtt, |rtt, handle| rtt.read(handle, channel))?.unwrap_or_default();
        if !bytes.is_empty() {
            self.heard = Some(channel);
        }
        Ok(bytes)
    }

    /// Sends bytes down a channel; returns how many. None go to a board that has restarted since
    /// it was heard last, and no key before it has been heard: who pressed it saw another start.
    pub fn down<R: Rtt<Handle = H>>(
        &mut self,
        rtt: &mut R,
        channel: u32,
        bytes: &[u8],
    ) -> Result<usize, R::Error> {
        let heard = self.heard;
        let sent = self.with(rtt, |rtt, handle| match heard {
            None if channel == CONSOLE => Ok(0),
            heard => rtt.write(handle, heard, channel, bytes),
        });
        Ok(sent?.unwrap_or(0))
    }

    /// Acts on the channels; none if there are none.
    fn with<T, R: Rtt<Handle = H>>(
        &mut self,
        rtt: &mut R,
        act: impl FnOnce(&mut R, &mut H) -> Access<T, R::Error>,
    ) -> Result<Option<T>, R::Error> {
        if self.handle.is_none() {
            self.handle = rtt.attach()?;
        }
        let Some(handle) = &mut self.handle else { return Ok(None) };
        match act(rtt, handle) {
            Ok(done) => Ok(Some(done)),
            Err(ChannelError::Stale) => {
                self.forget();
                Ok(None)
            }
            Err(ChannelError::Failed(error)) => Err(error),
        }
    }
}
