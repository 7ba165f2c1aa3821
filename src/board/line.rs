//! The binary line to the host over real-time transfer.

use interstage::hal::Line;
use rtt_target::{ChannelMode, DownChannel, UpChannel};

/// RTT up channel 2 and down channel 1.
pub(crate) struct HostLine {
    up: UpChannel,
    down: DownChannel,
}

impl HostLine {
    pub(crate) fn new((up, down): (UpChannel, DownChannel)) -> Self {
        Self { up, down }
    }
}

impl Line for HostLine {
    fn read(&mut self, bytes: &mut [u8]) -> usize {
        self.down.read(bytes)
    }

    fn write(&mut self, bytes: &[u8]) -> bool {
        // A probe may have switched it to blocking.
        self.up.set_mode(ChannelMode::NoBlockSkip);
        self.up.write(bytes) == bytes.len()
    }

    fn restart(&mut self) {
        cortex_m::peripheral::SCB::sys_reset()
    }
}
