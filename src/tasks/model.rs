//! The planning task.

use super::clock::{mid_tick_deadline, uptime};
use super::exchange::Exchange;
use super::{ROUND, TaskId};
use crate::model::Planner;
use embassy_time::with_deadline;

/// Answers the tick's requests for a plan, below the control rate and for as long
/// as it takes; of several requests meanwhile, the latest counts.
pub async fn model(planner: &Planner, exchange: &Exchange) -> ! {
    loop {
        exchange.check_in(TaskId::Model, uptime());
        let request = with_deadline(mid_tick_deadline(ROUND), exchange.request.wait()).await;
        if let Ok(request) = request {
            exchange.liveness.running(TaskId::Model);
            exchange.answer.signal(planner.plan(&request));
        }
    }
}
