//! The planning task.

use super::ROUND;
use super::exchange::{Exchange, TaskId, latest};
use crate::model::Planner;
use embassy_time::with_deadline;

/// Answers the tick's requests for a plan, below the control rate and for as long
/// as it takes; of several requests meanwhile, the latest counts.
pub async fn model(planner: &Planner, exchange: &Exchange) -> ! {
    loop {
        exchange.check_in(TaskId::Model, exchange.uptime());
        let round = exchange.aside(ROUND);
        if let Ok(request) = with_deadline(round, exchange.request.receive()).await {
            exchange.wake(TaskId::Model);
            latest(&exchange.answer, planner.plan(&request));
        }
    }
}
