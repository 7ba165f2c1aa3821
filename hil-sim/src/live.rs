//! A log under way on the screen and on the network.

mod picture;
mod screen;
mod server;

pub use picture::svg;
pub use screen::Screen;
pub use server::{Server, Topic};
