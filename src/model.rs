//! The tread, rolled out, and the schedule made from it.

pub mod approach;
pub mod corner_profile;
pub mod guard;
pub mod history;
pub mod plan;
pub mod planner;
pub mod profile;
pub mod rollout;
pub mod timing;
pub mod tread;
pub mod wind_up;

pub use approach::Approach;
pub use plan::{Learned, LimitedBy, Outcome, Plan, PlanRequest, Review, Strategy};
pub use planner::Planner;
