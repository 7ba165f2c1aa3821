//! The binary line to the host over real-time transfer.

use interstage::hal::Line;
use rtt_target::DownChannel;

use super::rtt::Frames;

/// RTT up channel 2 and down channel 1.
pub(crate) struct HostLine {
    up: Frames,
    down: DownChannel,
}

impl HostLine {
    pub(crate) fn new((up, down): (Frames, DownChannel)) -> Self {
        Self { up, down }
    }
}

impl Line for HostLine {
    fn read(&mut self, bytes: &mut [u8]) -> usize {
        self.down.read(bytes)
    }

    fn write(&mut self, bytes: &[u8]) -> bool {
        self.up.send(bytes)
    }

    fn restart(&mut self) {
        cortex_m::peripheral::SCB::sys_reset()
    }
}
