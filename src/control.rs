//! Control: the schedule of speed and preload, the speed profile, and the two loops.

pub mod preload_loop;
pub mod schedule;
pub mod speed_loop;
