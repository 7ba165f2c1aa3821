//! From readings to the state of motion and contact.

mod stage;

pub use stage::ContactStage;
