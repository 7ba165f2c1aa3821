//! Single letters from the debug probe as commands.

use embassy_time::{Duration, Timer};
use interstage::hal::CommandSource;
use interstage::supervise::Command;
use interstage::tasks::mid_tick_deadline;
use rtt_target::DownChannel;

/// Polling interval: the probe writes into memory without an interrupt.
const POLL: Duration = Duration::from_millis(20);

/// RTT down channel 0.
pub(crate) struct Console(pub(super) DownChannel);

impl CommandSource for Console {
    async fn next(&mut self) -> Command {
        loop {
            let mut letter = [0];
            if self.0.read(&mut letter) == 0 {
                Timer::at(mid_tick_deadline(POLL)).await;
            }
            return match letter {
                [b's'] => Command::Start,
                [b'x'] => Command::Stop,
                [b'r'] => Command::Retract,
                [b'0'] => Command::Reset,
                // Nothing has come, or a line end or another letter.
                _ => continue,
            };
        }
    }
}
