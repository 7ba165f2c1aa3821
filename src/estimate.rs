//! From readings to the state of motion and contact.

pub mod crossing;
pub mod odometry;
mod stage;
pub mod tread;
pub mod vibration;

pub use stage::ContactStage;
