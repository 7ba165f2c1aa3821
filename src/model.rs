//! The reduced collision-vibration model and the schedule made from it.

mod plan;

pub use plan::{Plan, PlanRequest, Planner};
