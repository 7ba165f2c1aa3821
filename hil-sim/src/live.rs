//! A log under way on the screen and on the network.

mod screen;
mod server;

pub use screen::Screen;
pub use server::Server;
