//! The operator's task.

use core::pin::pin;

use super::ROUND;
use super::clock::{mid_tick_deadline, uptime};
use super::exchange::Exchange;
use crate::hal::CommandSource;
use embassy_futures::select::{Either, select};
use embassy_time::Timer;

/// Hands the commands of one source to the tick, in their order; if four wait
/// already, the source waits.
pub async fn operator(mut source: impl CommandSource, exchange: &Exchange) -> ! {
    let task = exchange.liveness.enrol_operator();
    loop {
        let command = {
            // Kept while waiting: a gesture half made must not be forgotten at
            // each check-in.
            let mut next = pin!(source.next());
            loop {
                exchange.check_in(task, uptime());
                match select(next.as_mut(), Timer::at(mid_tick_deadline(ROUND))).await {
                    Either::First(command) => break command,
                    Either::Second(()) => {}
                }
            }
        };
        exchange.commands.send(command).await;
    }
}
