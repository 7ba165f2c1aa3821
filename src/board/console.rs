//! Single letters from the debug probe as commands.

use embassy_time::{Duration, Timer};
use interstage::hal::CommandSource;
use interstage::supervise::Command;
use interstage::tasks::mid_tick_deadline;
use rtt_target::DownChannel;

/// Polling interval: the probe writes into memory without an interrupt.
const POLL: Duration = Duration::from_millis(20);

/// RTT down channel 0.
pub(crate) struct Console(DownChannel);

impl Console {
    pub(crate) fn new(channel: DownChannel) -> Self {
        Self(channel)
    }
}

impl CommandSource for Console {
    async fn next(&mut self) -> Command {
        loop {
            let mut letter = [0];
            if self.0.read(&mut letter) == 0 {
                Timer::at(mid_tick_deadline(POLL)).await;
            } else if let Some(command) = decode(letter[0]) {
                return command;
            }
        }
    }
}

/// The command of a letter; none for line ends and other letters.
fn decode(letter: u8) -> Option<Command> {
    match letter {
        b's' => Some(Command::Start),
        b'x' => Some(Command::Stop),
        b'r' => Some(Command::Retract),
        b'0' => Some(Command::Reset),
        _ => None,
    }
}
