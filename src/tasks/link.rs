//! The task at the host's binary line.

use super::clock::{mid_tick_deadline, uptime};
use super::exchange::Exchange;
use crate::hal::Line;
use crate::params::link::{FrameReader, ToBoard, ToHost, frame};
use crate::params::service::{Request, Response, Service};
use crate::params::slots::SetMemory;
use embassy_time::{Duration, Timer};

/// How often the line is polled: the host writes without an interrupt.
const POLL: Duration = Duration::from_millis(10);

/// Answers the host's requests about the parameters, one after the other.
///
/// It checks in like an operator's task: a flash that never becomes ready is a task that
/// hangs.
pub async fn link<M: SetMemory>(
    mut line: impl Line,
    mut service: Service<M>,
    exchange: &Exchange,
) -> ! {
    let task = exchange.liveness.enrol_operator();
    let mut reader = FrameReader::new();
    loop {
        exchange.check_in(task, uptime());
        let mut byte = [0];
        if line.read(&mut byte) == 0 {
            Timer::at(mid_tick_deadline(POLL)).await;
            continue;
        }
        let Some(ToBoard::Parameters(number, request)) = reader.take(byte[0]) else { continue };
        let restarts = request == Request::Restart;
        let response = service.answer(request, exchange.at_rest()).await;
        let done = response == Response::Done;
        if let Some(frame) = frame(&ToHost::Parameters(number, response)) {
            // A host that does not read asks again.
            let _ = line.write(&frame);
        }
        if restarts && done {
            // For the answer to be fetched.
            Timer::after(POLL * 2).await;
            line.restart();
        }
    }
}
