//! Shows a growing log on the terminal and publishes it on the network.

mod plot;
mod screen;
mod server;

pub(crate) use screen::{Known, Screen};
pub use server::Server;
