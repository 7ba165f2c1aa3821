//! Shows a growing log on the terminal and publishes it on the network.

mod screen;
mod server;

pub use screen::Screen;
pub use server::Server;
