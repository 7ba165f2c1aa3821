//! Controller and plant in closed loop.

mod anomalies;
mod deployment;
mod restarts;
mod silence;
mod supervisor;
mod tasks_on_the_plant;
mod treads;
