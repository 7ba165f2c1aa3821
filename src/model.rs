//! The reduced collision-vibration model and the schedule made from it.

pub mod constants;
pub mod corner_profile;
pub mod dip;
pub mod effective_stiffness;
pub mod formula;
pub mod guard;
pub mod impact;
mod plan;
pub mod planner;
pub mod reduced;
pub mod rollout;
pub mod timing;
pub mod tread;

pub use plan::{Approach, Learned, LimitedBy, Outcome, Plan, PlanRequest, Review, Strategy};
pub use planner::Planner;
